//! What can go wrong.

use std::fmt;
use std::time::Duration;

use faulty_link::Direction;

pub mod ranges;
mod words;

/// What stands between the processes of a system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layout {
    /// `kittiwake up`: one router for all, and a launcher.
    OneRouter,
    /// `kittiwake up --onboard`: the same, with all nodes on board but the vehicle in one process.
    Composed,
    /// As it is deployed: a router on board and one on the ground, an encrypted link between them that may have faults, and
    /// for each machine somebody who starts again what has ended, as systemd does.
    TwoRouters,
}

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
    /// The process of all nodes on board, in a system that has one.
    Onboard,
    /// The control tower.
    ControlTower,
    /// The gateway.
    Gateway,
    /// The router of those on board; in a system with one router, of all.
    Router,
    /// The router on the ground, in a system with two.
    GroundRouter,
}

impl Victim {
    /// Every one. No system has all of them, see [`Victim::of`]: a ground router only with two, the last only where it replaces
    /// the first four.
    pub const ALL: [Victim; 9] = [
        Victim::Mcm,
        Victim::Planner,
        Victim::SkillManager,
        Victim::Monitor,
        Victim::ControlTower,
        Victim::Gateway,
        Victim::Router,
        Victim::GroundRouter,
        Victim::Onboard,
    ];

    /// Those of the aircraft's computer beside the autopilot, in a system with two routers.
    pub const ON_COMPANION: [Victim; 5] =
        [Victim::Router, Victim::Mcm, Victim::Planner, Victim::SkillManager, Victim::Monitor];

    /// Those of a system of this layout.
    pub fn of(layout: Layout) -> &'static [Victim] {
        match layout {
            Layout::OneRouter => &Victim::ALL[..Victim::ALL.len() - 2],
            Layout::Composed => &[Victim::Onboard, Victim::ControlTower, Victim::Gateway, Victim::Router],
            Layout::TwoRouters => &Victim::ALL[..Victim::ALL.len() - 1],
        }
    }

    /// Those of a system of this layout whose state is what a mission goes on from.
    pub fn with_state(layout: Layout) -> &'static [Victim] {
        match layout {
            Layout::Composed => &[Victim::Onboard],
            Layout::OneRouter | Layout::TwoRouters => &[Victim::Mcm, Victim::Planner],
        }
    }

    /// The nodes in it, by the names of their heartbeats and of their files; a router has none.
    pub fn nodes(self) -> &'static [&'static str] {
        match self {
            Victim::Mcm => &["mcm"],
            Victim::Planner => &["planner"],
            Victim::SkillManager => &["skill-manager"],
            Victim::Monitor => &["monitor"],
            Victim::Onboard => &["mcm", "planner", "skill-manager", "monitor"],
            Victim::ControlTower => &["control-tower"],
            Victim::Gateway => &["gateway"],
            Victim::Router | Victim::GroundRouter => &[],
        }
    }

    /// Its name: the subcommand, and how the launcher calls it.
    pub fn name(self) -> &'static str {
        match self {
            Victim::Mcm => "mcm",
            Victim::Planner => "planner",
            Victim::SkillManager => "skill-manager",
            Victim::Monitor => "monitor",
            Victim::Onboard => "onboard",
            Victim::ControlTower => "control-tower",
            Victim::Gateway => "gateway",
            Victim::Router => "router",
            Victim::GroundRouter => "ground-router",
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

    /// The flag of the contingency row that carries it out.
    pub fn flag(self) -> &'static str {
        match self {
            Order::Abort => "operator_abort",
            Order::Return => "operator_return",
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

/// Directions of the link in which nothing passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Ways {
    /// Both.
    Both,
    /// Nothing reaches the ground.
    Down,
    /// Nothing reaches the aircraft.
    Up,
}

impl Ways {
    /// As the link knows them.
    pub fn directions(self) -> &'static [Direction] {
        match self {
            Ways::Both => &[Direction::Down, Direction::Up],
            Ways::Down => &[Direction::Down],
            Ways::Up => &[Direction::Up],
        }
    }
}

/// Whose clock is set: processes of one machine have one clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Machine {
    /// Those on board.
    Aircraft,
    /// Those on the ground.
    Ground,
    /// Both by the same; the only one in a system with one router, composed or not.
    Both,
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
    /// The aircraft's computer beside the autopilot is without power for that time, and its router with it: the vehicle flies on meanwhile.
    CompanionOff(Duration),
    /// The disk of the persisted state is full for that time.
    FullDisk(Duration),
    /// A process with persisted state is killed, and its state is garbled before it is back.
    GarbledState(Victim, Garbling),
    /// That number of connections of strangers to the gateway and to the router, which send garbage and stay.
    Strangers(u32),
    /// Unexpected messages at this rate per second, for this time.
    Flood(u32, Duration),
    /// Sixteen flags of the contingency table rise and fall in turn, a thousand events a second, for this time. The number draws
    /// which.
    Storm(u64, Duration),
    /// The wall clock of a machine is set by this many milliseconds; its monotonic clock goes on.
    ClockStep(Machine, i64),
    /// Nothing passes over the link for this time. With an order: it is given once, right after the cut.
    Cut(Ways, Duration, Option<Order>),
    /// Everything on the link is late by the first time, each way, for the second.
    Slow(Duration, Duration),
    /// The link carries this many bits a second each way, for this time.
    Narrow(u64, Duration),
    /// An operator's order. No trouble, but what follows must obey it.
    Ordered(Order),
    /// Somebody at the control tower revokes every permission that there is, or the first that is granted after that.
    Revocation,
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
    /// [`Trouble::CompanionOff`].
    CompanionOff,
    /// [`Trouble::FullDisk`].
    FullDisk,
    /// [`Trouble::GarbledState`].
    GarbledState,
    /// [`Trouble::Strangers`].
    Strangers,
    /// [`Trouble::Flood`].
    Flood,
    /// [`Trouble::Storm`].
    Storm,
    /// [`Trouble::ClockStep`].
    ClockStep,
    /// [`Trouble::Cut`].
    Cut,
    /// [`Trouble::Slow`].
    Slow,
    /// [`Trouble::Narrow`].
    Narrow,
    /// [`Trouble::Ordered`].
    Ordered,
    /// [`Trouble::Revocation`].
    Revocation,
}

impl Trouble {
    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Trouble::Kill(_) => Kind::Kill,
            Trouble::Stop(..) => Kind::Stop,
            Trouble::DoubleKill(..) => Kind::DoubleKill,
            Trouble::CrashLoop(..) => Kind::CrashLoop,
            Trouble::PowerLoss(_) => Kind::PowerLoss,
            Trouble::CompanionOff(_) => Kind::CompanionOff,
            Trouble::FullDisk(_) => Kind::FullDisk,
            Trouble::GarbledState(..) => Kind::GarbledState,
            Trouble::Strangers(_) => Kind::Strangers,
            Trouble::Flood(..) => Kind::Flood,
            Trouble::Storm(..) => Kind::Storm,
            Trouble::ClockStep(..) => Kind::ClockStep,
            Trouble::Cut(..) => Kind::Cut,
            Trouble::Slow(..) => Kind::Slow,
            Trouble::Narrow(..) => Kind::Narrow,
            Trouble::Ordered(_) => Kind::Ordered,
            Trouble::Revocation => Kind::Revocation,
        }
    }

    /// Wall time for which the link is not what it should be.
    pub fn link_is_faulty_for(&self) -> Duration {
        match self {
            Trouble::Cut(_, time, _) | Trouble::Slow(_, time) | Trouble::Narrow(_, time) => *time,
            _ => Duration::ZERO,
        }
    }

    /// Wall time until it is over by itself, apart from what it has caused. A loss of power is not among them: it is over when a
    /// new system is started.
    pub fn lasts(&self) -> Duration {
        match self {
            Trouble::Stop(_, time) | Trouble::DoubleKill(_, _, time) | Trouble::FullDisk(time) => *time,
            Trouble::CompanionOff(time) => *time,
            Trouble::Flood(_, time) | Trouble::Storm(_, time) => *time,
            other => other.link_is_faulty_for(),
        }
    }

    /// For how much of that time somebody may be dead, hung or cut off who has to hear of a permission or to heed it.
    pub fn deafens_for(&self) -> Duration {
        match self {
            // The witness hears a tower whose disk is full when everybody does, and nobody flies by what the gateway says.
            Trouble::FullDisk(_) | Trouble::Stop(Victim::Gateway, _) => Duration::ZERO,
            other => other.lasts(),
        }
    }

    /// Deaths of processes that it may cause; a stop may end in one, by the launcher.
    pub fn deaths(&self) -> Vec<(Victim, u32)> {
        match self {
            Trouble::Kill(victim) | Trouble::Stop(victim, _) | Trouble::GarbledState(victim, _) => vec![(*victim, 1)],
            Trouble::DoubleKill(first, second, _) => vec![(*first, 1), (*second, 1)],
            Trouble::CrashLoop(victim, times) => vec![(*victim, *times)],
            Trouble::CompanionOff(_) => Victim::ON_COMPANION.map(|it| (it, 1)).into(),
            _ => Vec::new(),
        }
    }

    /// How often something is interrupted by these deaths: those of a whole computer are one interruption.
    pub fn interruptions(&self) -> u32 {
        match self {
            Trouble::CompanionOff(_) => 1,
            other => other.deaths().iter().map(|it| it.1).sum(),
        }
    }
}
