//! Twins of the smoothing filters against closed forms and definitions.

mod bilateral;
mod binomial;
mod curvature_flow;
mod every_filter;
mod narrow_range;
mod support;
