//! The reference's figures (its tables 5.1 to 5.3), measured on an i7-6700 with ROS 2 Foxy and
//! BehaviorTree.CPP, in milliseconds, for tick periods of 10, 5 and 1 ms.

use serde::Serialize;

/// The reference's tick periods, in its order.
const TICKS: [u32; 3] = [10, 5, 1];

/// A row of table 5.1 or 5.2.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Row {
    pub max: [f64; 3],
    pub min: [f64; 3],
    pub mean: [f64; 3],
    pub std_dev: [f64; 3],
}

pub(crate) const N2N: Row =
    Row { max: [82.3, 87.8, 82.4], min: [49.3, 47.2, 43.5], mean: [64.8, 69.3, 62.5], std_dev: [11.4, 12.1, 11.9] };
pub(crate) const N2T: Row =
    Row { max: [55.7, 68.0, 68.2], min: [20.4, 30.2, 24.9], mean: [42.2, 50.6, 52.3], std_dev: [8.0, 7.9, 10.8] };
pub(crate) const T2N: Row =
    Row { max: [120.8, 110.3, 104.3], min: [31.7, 35.9, 31.6], mean: [71.4, 79.1, 79.7], std_dev: [25.8, 18.5, 23.2] };
pub(crate) const P2P: Row =
    Row { max: [120.8, 110.3, 103.6], min: [39.5, 39.9, 48.1], mean: [65.8, 69.7, 72.4], std_dev: [21.9, 19.5, 18.7] };
pub(crate) const P2O: Row =
    Row { max: [81.2, 87.8, 82.4], min: [31.7, 47.2, 43.5], mean: [57.4, 73.5, 61.1], std_dev: [17.5, 16.5, 13.3] };
pub(crate) const O2P: Row =
    Row { max: [54.5, 69.9, 65.0], min: [49.3, 48.9, 49.8], mean: [52.9, 55.5, 56.0], std_dev: [2.1, 8.5, 5.0] };
pub(crate) const O2O: Row =
    Row { max: [50.4, 56.0, 63.0], min: [20.4, 30.2, 24.9], mean: [35.9, 43.0, 37.7], std_dev: [8.3, 9.0, 10.9] };

/// Table 5.3, mean.
pub(crate) const FLAT: [f64; 3] = [0.67, 0.60, 0.62];
pub(crate) const NESTED: [f64; 3] = [0.51, 0.51, 0.39];

/// The whole reference, for the machine-readable report.
#[derive(Debug, Serialize)]
pub(crate) struct Reference {
    tick_periods_ms: [u32; 3],
    transitions_ms: [(&'static str, Row); 7],
    flag_to_action_ms: [(&'static str, [f64; 3]); 2],
}

/// The reference's figures.
pub(crate) const ALL: Reference = Reference {
    tick_periods_ms: TICKS,
    transitions_ms: [("N2N", N2N), ("N2T", N2T), ("T2N", T2N), ("P2P", P2P), ("P2O", P2O), ("O2P", O2P), ("O2O", O2O)],
    flag_to_action_ms: [("flat", FLAT), ("nested", NESTED)],
};

/// The column of a tick period; `None` where the reference has none.
pub(crate) fn column(tick_ms: u32) -> Option<usize> {
    TICKS.iter().position(|it| *it == tick_ms)
}
