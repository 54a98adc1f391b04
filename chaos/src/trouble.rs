//! What can go wrong, and within which ranges it is drawn.

use std::fmt;
use std::ops::RangeInclusive;
use std::time::Duration;

/// A process that a trouble befalls.
///
/// The simulator is not among those that are killed: it is the world, and a new one begins on the ground at home. A loss of
/// power takes it as well, as it takes the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Victim {
    /// The mission manager.
    Mcm,
    /// The planner.
    Planner,
    /// The skill manager.
    SkillManager,
    /// The monitor.
    Monitor,
    /// The control tower.
    ControlTower,
    /// The gateway.
    Gateway,
    /// The router that all are connected to.
    Router,
}

impl Victim {
    /// Every one.
    pub const ALL: [Victim; 7] = [
        Victim::Mcm,
        Victim::Planner,
        Victim::SkillManager,
        Victim::Monitor,
        Victim::ControlTower,
        Victim::Gateway,
        Victim::Router,
    ];

    /// Its name: the subcommand, and how the launcher calls it.
    pub fn name(self) -> &'static str {
        match self {
            Victim::Mcm => "mcm",
            Victim::Planner => "planner",
            Victim::SkillManager => "skill-manager",
            Victim::Monitor => "monitor",
            Victim::ControlTower => "control-tower",
            Victim::Gateway => "gateway",
            Victim::Router => "router",
        }
    }
}

impl fmt::Display for Victim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// An order that an operator gives over the gateway.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Order {
    /// Land here and end the mission.
    Abort,
    /// Fly home, land and end the mission.
    Return,
}

impl Order {
    /// The verb of `kittiwake vehicle`.
    pub fn verb(self) -> &'static str {
        match self {
            Order::Abort => "abort",
            Order::Return => "return",
        }
    }
}

/// What is done to a file of persisted state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Garbling {
    /// Bits in the middle are turned.
    Flipped,
    /// The second half is missing.
    Cut,
    /// Nothing is left.
    Emptied,
}

/// Something that goes wrong. Durations are wall time.
#[derive(Debug, Clone, PartialEq)]
pub enum Trouble {
    /// `kill -9`.
    Kill(Victim),
    /// SIGSTOP, and SIGCONT after that time if the process is still there.
    Stop(Victim, Duration),
    /// Two processes are killed, the second this long after the first.
    DoubleKill(Victim, Victim, Duration),
    /// Killed this number of times, each time as soon as it is back.
    CrashLoop(Victim, u32),
    /// Everything is killed at once, and started again over the same state after that time.
    PowerLoss(Duration),
    /// The disk of the persisted state is full for that time.
    FullDisk(Duration),
    /// A process with persisted state is killed, and its state is garbled before it is back.
    GarbledState(Victim, Garbling),
    /// That number of connections of strangers to the gateway and to the router, which send garbage and stay.
    Strangers(u32),
    /// Unexpected messages at this rate per second, for this time.
    Flood(u32, Duration),
    /// An operator's order. No trouble, but what follows must obey it.
    Ordered(Order),
}

/// The troubles without their values, as the table below knows them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// [`Trouble::Kill`].
    Kill,
    /// [`Trouble::Stop`].
    Stop,
    /// [`Trouble::DoubleKill`].
    DoubleKill,
    /// [`Trouble::CrashLoop`].
    CrashLoop,
    /// [`Trouble::PowerLoss`].
    PowerLoss,
    /// [`Trouble::FullDisk`].
    FullDisk,
    /// [`Trouble::GarbledState`].
    GarbledState,
    /// [`Trouble::Strangers`].
    Strangers,
    /// [`Trouble::Flood`].
    Flood,
    /// [`Trouble::Ordered`].
    Ordered,
}

/// How often each kind is drawn, relative to the others.
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
    (Kind::Ordered, 3),
];

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
/// Wall milliseconds with a full disk.
pub const FULL_MS: RangeInclusive<u64> = 1_000..=20_000;
/// Connections of strangers.
pub const STRANGERS: RangeInclusive<u32> = 1..=200;
/// Messages a second of a flood, and its wall milliseconds.
pub const FLOOD_HZ: RangeInclusive<u32> = 200..=3_000;
/// See [`FLOOD_HZ`].
pub const FLOOD_MS: RangeInclusive<u64> = 500..=5_000;

impl Trouble {
    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Trouble::Kill(_) => Kind::Kill,
            Trouble::Stop(..) => Kind::Stop,
            Trouble::DoubleKill(..) => Kind::DoubleKill,
            Trouble::CrashLoop(..) => Kind::CrashLoop,
            Trouble::PowerLoss(_) => Kind::PowerLoss,
            Trouble::FullDisk(_) => Kind::FullDisk,
            Trouble::GarbledState(..) => Kind::GarbledState,
            Trouble::Strangers(_) => Kind::Strangers,
            Trouble::Flood(..) => Kind::Flood,
            Trouble::Ordered(_) => Kind::Ordered,
        }
    }

    /// Deaths of processes that it may cause; a stop may end in one, by the launcher.
    pub fn deaths(&self) -> Vec<(Victim, u32)> {
        match self {
            Trouble::Kill(victim) | Trouble::Stop(victim, _) | Trouble::GarbledState(victim, _) => vec![(*victim, 1)],
            Trouble::DoubleKill(first, second, _) => vec![(*first, 1), (*second, 1)],
            Trouble::CrashLoop(victim, times) => vec![(*victim, *times)],
            _ => Vec::new(),
        }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Trouble::Kill(victim) => write!(f, "kill {victim}"),
            Trouble::Stop(victim, time) => write!(f, "stop {victim} for {:.1} s", time.as_secs_f64()),
            Trouble::DoubleKill(first, second, apart) => {
                write!(f, "kill {first}, and {second} {:.1} s later", apart.as_secs_f64())
            }
            Trouble::CrashLoop(victim, times) => write!(f, "kill {victim} {times} times in a row"),
            Trouble::PowerLoss(dark) => write!(f, "power lost for {:.1} s", dark.as_secs_f64()),
            Trouble::FullDisk(time) => write!(f, "disk full for {:.1} s", time.as_secs_f64()),
            Trouble::GarbledState(victim, garbling) => {
                let how = match garbling {
                    Garbling::Flipped => "bits turned",
                    Garbling::Cut => "cut in half",
                    Garbling::Emptied => "emptied",
                };
                write!(f, "kill {victim}, its state {how}")
            }
            Trouble::Strangers(count) => write!(f, "{count} strangers"),
            Trouble::Flood(rate_hz, time) => write!(f, "{rate_hz} messages/s for {:.1} s", time.as_secs_f64()),
            Trouble::Ordered(order) => write!(f, "order {}", order.verb()),
        }
    }
}
