//! How often each kind of trouble is drawn, and within which ranges its values are.

use std::ops::RangeInclusive;

use super::Kind;

/// How often each kind is drawn, relative to the others, in a system of any layout.
pub const WEIGHTS: &[(Kind, u32)] = &[
    (Kind::Kill, 10),
    (Kind::Stop, 8),
    (Kind::DoubleKill, 4),
    (Kind::CrashLoop, 2),
    (Kind::PowerLoss, 2),
    (Kind::FullDisk, 2),
    (Kind::GarbledState, 2),
    (Kind::Strangers, 2),
    (Kind::Flood, 2),
    (Kind::Storm, 2),
    (Kind::ClockStep, 3),
    (Kind::Ordered, 3),
    (Kind::Revocation, 4),
];

/// The same for those that need two routers, as the aircraft's and the ground's computers have them, and a link between these: in such a
/// system about half of all troubles.
pub const TWO_ROUTERS_WEIGHTS: &[(Kind, u32)] =
    &[(Kind::Cut, 20), (Kind::Slow, 10), (Kind::Narrow, 10), (Kind::CompanionOff, 6)];

/// Wall milliseconds of a stop: from a pause of the scheduler to far beyond the limit of a process that hangs.
pub const STOP_MS: RangeInclusive<u64> = 300..=30_000;
/// Wall milliseconds between the two of a double kill: at once, or while the first is on its way back.
pub const APART_MS: RangeInclusive<u64> = 0..=1_500;
/// Deaths in a crash loop. One more than the most is given up by the launcher on the ground, see `[launcher.restart]`.
pub const LOOP_DEATHS: RangeInclusive<u32> = 2..=MOST_DEATHS;
/// Deaths of one process in a whole run.
pub const MOST_DEATHS: u32 = 4;
/// Wall milliseconds without power.
pub const DARK_MS: RangeInclusive<u64> = 100..=3_000;
/// Wall milliseconds without the aircraft's computer: from a short interruption to a start of an operating system.
pub const OFF_MS: RangeInclusive<u64> = 300..=20_000;
/// Wall milliseconds with a full disk.
pub const FULL_MS: RangeInclusive<u64> = 1_000..=20_000;
/// Connections of strangers.
pub const STRANGERS: RangeInclusive<u32> = 1..=200;
/// Messages a second of a flood, and its wall milliseconds.
pub const FLOOD_HZ: RangeInclusive<u32> = 200..=3_000;
/// See [`FLOOD_HZ`].
pub const FLOOD_MS: RangeInclusive<u64> = 500..=5_000;
/// Known flags of a storm: the number that the reliability notes name.
pub const STORM_FLAGS: usize = 16;
/// Events a second of a storm; the notes' number.
pub const STORM_HZ: u32 = 1_000;
/// Wall milliseconds of a storm.
pub const STORM_MS: RangeInclusive<u64> = 500..=5_000;
/// Milliseconds that a clock is set forward or back, from a correction over the network to a wrong time zone.
pub const STEP_MS: RangeInclusive<u64> = 500..=3 * 3_600_000;
/// Wall milliseconds of a fault of the link: limits of the link (`link_lost` after 10 s, `link_gone` after 120 s, the silence
/// after which a connection is given up) are wall time at any speed.
pub const LINK_MS: RangeInclusive<u64> = 500..=60_000;
/// Delay one way over a slow link, in wall milliseconds: from a radio's to one at which no order can be in time.
pub const DELAY_MS: RangeInclusive<u64> = 50..=5_000;
/// Bits a second of a narrow link. At real time the telemetry wants 34,000, see docs/deployment.md.
pub const NARROW_BITS_S: RangeInclusive<u64> = 4_000..=128_000;
