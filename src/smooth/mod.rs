//! Smoothing filters on the depth maps of the body: rivals of plane fitting, one folder each.

pub mod twin;

/// Bilateral filter over a square window (Imai14).
pub mod bilateral {
    pub mod twin;
}
/// Bilateral filter, rows then columns (Green10).
pub mod bilateral_separable {
    pub mod twin;
}
/// Binomial filter with a silhouette map (Cords08).
pub mod binomial {
    pub mod twin;
}
/// Curvature flow (vdLaan09).
pub mod curvature_flow {
    pub mod twin;
}
/// Narrow-range filter (Truong18).
pub mod narrow_range {
    pub mod twin;
}
