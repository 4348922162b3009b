//! What the codes in dumps and statistics mean.

use meniscus::shader as s;

pub const PATTERNS: &[(u32, &str)] = &[
    (s::PATTERN_NONE, "no liquid"),
    (s::PATTERN_SPLASH, "splash, no second volume"),
    (s::PATTERN_BODY, "body, no second volume"),
    (s::PATTERN_SPLASH_SPLASH, "splash, splash"),
    (s::PATTERN_SPLASH_BODY, "splash, body"),
    (s::PATTERN_BODY_SPLASH, "body, splash"),
    (s::PATTERN_BODY_BODY, "body, body"),
];

pub const OUTCOMES: &[(u32, &str)] = &[
    (s::OUTCOME_NO_LIQUID, "no liquid"),
    (s::OUTCOME_HIT, "hit"),
    (s::OUTCOME_SIDE_WALL, "side wall: walked to its end, but a map ended or jumped at one of the walls"),
    (s::OUTCOME_LEFT_VIEW, "left the view"),
    (s::OUTCOME_NO_WALL, "left the liquid's box inside the liquid"),
    (s::OUTCOME_NOT_CONVERGED, "not converged"),
    (s::OUTCOME_REFLECTION_LIMIT, "limit of internal reflections"),
    (s::OUTCOME_SCENE, "met the host's scene"),
];
