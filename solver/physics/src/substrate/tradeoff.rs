//! Trade-offs of the stress in a substrate: how far loads are summed.

use super::settings::Settings;
use crate::common::tradeoff::{Axis, Point, Setup, Tradeoff, set};

/// The key of the far field.
const FAR_FIELD: &str = "substrate.far-field";
/// The value that sums every load.
const ALL: &str = "{ method = \"none\" }";

/// What a substrate contributes to trade-offs.
pub static TRADEOFF: Tradeoff = Tradeoff {
    axes: &[Axis { name: "substrate", points: far_fields }],
    tighter: |setup, _| {
        let grouped = setup.tables.main::<Settings>().and_then(|substrate| substrate.far_field_tolerance);
        grouped.map(|_| vec![set(FAR_FIELD, ALL)]).unwrap_or_default()
    },
    usual: &["rms von_mises_stress"],
    words: &[("stress", "rms von_mises_stress"), ("peak stress", "peak von_mises_stress")],
    ..Tradeoff::NONE
};

fn far_fields(setup: &Setup<'_>) -> Vec<Point> {
    match setup.tables.main::<Settings>() {
        Some(substrate) if substrate.far_field_tolerance.is_none() => [1e-3, 1e-2, 1e-1]
            .map(|tolerance| {
                let value = format!("{{ method = \"grouped\", tolerance = {tolerance:e} }}");
                Point::of(format!("far field {tolerance:e}"), FAR_FIELD, value)
            })
            .into(),
        Some(_) => vec![Point::of("far field none".into(), FAR_FIELD, ALL)],
        None => Vec::new(),
    }
}
