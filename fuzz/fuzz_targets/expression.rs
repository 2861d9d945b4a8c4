#![no_main]

use std::sync::Arc;

use alhazen::geometry::{AnalyticShape, Expression, Implicit};
use alhazen::math::Bounds;
use glam::DVec3;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(expression) = Expression::parse(text) else { return };
    let _ = expression.value(DVec3::new(0.3, -0.2, 0.7));
    let bounds = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };
    let shape = Implicit::new(Arc::new(expression), bounds);
    let (origin, direction) = (DVec3::new(3.0, 0.1, -0.2), DVec3::new(-1.0, 0.01, 0.05));
    if let Some(hit) = shape.intersect(origin, direction, 0.0, f64::INFINITY) {
        assert!(hit.t > 0.0 && hit.t.is_finite());
    }
});
