//! Troubles in words.

use std::fmt;

use super::ranges::{STORM_FLAGS, STORM_HZ};
use super::{Garbling, Machine, Trouble, Ways};

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
            Trouble::CompanionOff(time) => write!(f, "the aircraft's computer off for {:.1} s", time.as_secs_f64()),
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
            Trouble::Storm(_, time) => {
                write!(f, "{STORM_FLAGS} flags rise and fall at {STORM_HZ} Hz for {:.1} s", time.as_secs_f64())
            }
            Trouble::ClockStep(machine, ms) => {
                let whose = match machine {
                    Machine::Aircraft => "the aircraft's clock",
                    Machine::Ground => "the ground's clock",
                    Machine::Both => "every clock",
                };
                let way = if *ms < 0 { "back" } else { "forward" };
                write!(f, "{whose} {way} by {:.1} s", ms.unsigned_abs() as f64 / 1e3)
            }
            Trouble::Cut(ways, time, order) => {
                let ways = match ways {
                    Ways::Both => "",
                    Ways::Down => " towards the ground",
                    Ways::Up => " towards the aircraft",
                };
                write!(f, "link cut{ways} for {:.1} s", time.as_secs_f64())?;
                order.map_or(Ok(()), |it| write!(f, ", with the order {}", it.verb()))
            }
            Trouble::Slow(delay, time) => {
                write!(f, "link slower by {:.2} s for {:.1} s", delay.as_secs_f64(), time.as_secs_f64())
            }
            Trouble::Narrow(bits_per_s, time) => {
                write!(f, "link of {:.1} kbit/s for {:.1} s", *bits_per_s as f64 / 1e3, time.as_secs_f64())
            }
            Trouble::Ordered(order) => write!(f, "order {}", order.verb()),
            Trouble::Revocation => f.write_str("permissions revoked"),
        }
    }
}
