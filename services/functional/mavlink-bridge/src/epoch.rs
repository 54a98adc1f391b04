//! Whether positions can still be compared: the autopilot was started again, the origin of its local frame or home has moved, or the
//! position has jumped.

use std::time::Duration;

use domain::time::Time;

use crate::heard::{Heard, LocalPosition};
use crate::vector::{difference, length};
use crate::vehicle::Vehicle;

/// What has happened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Break {
    /// It was started again.
    Restart,
    /// The frame has moved, in this way.
    Moved(String),
}

/// Follows clock, origin, home and position.
#[derive(Debug)]
pub(crate) struct Epoch {
    jump_m: f64,
    breaks: u64,
    boot_ms: Option<u32>,
    /// How many messages in a row were older than the newest.
    older: u32,
    origin: Option<[i32; 3]>,
    home: Option<[i32; 3]>,
    position: Option<(u32, LocalPosition)>,
}

/// A message that was overtaken on its way is not older than this.
const OVERTAKEN_MS: u32 = 2_000;
/// This many old messages in a row are not an accident: the clock has begun again.
const RESTARTED_AFTER: u32 = 3;
/// Home moves to the vehicle at each arming, PX4's at each takeoff, too, and that is said within a few seconds.
const SETTLES: Duration = Duration::from_secs(5);
/// Home's height wanders in flight, by 1.6 m where that was measured; over ground it does not.
const HOME_MOVED_M: f64 = 10.0;

impl Epoch {
    /// Nothing was heard.
    pub(crate) fn new(jump_m: f64) -> Epoch {
        Epoch { jump_m, breaks: 0, boot_ms: None, older: 0, origin: None, home: None, position: None }
    }

    /// Names the frame: as long as it is the same, so is this, even if this process is started again.
    pub(crate) fn number(&self) -> u64 {
        /// Fowler, Noll, Vo: offset and prime of the 64 bit hash.
        const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
        const PRIME: u64 = 0x0000_0100_0000_01b3;
        let bytes = self.origin.into_iter().flatten().flat_map(i32::to_le_bytes);
        let hash = bytes.fold(OFFSET, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME));
        hash.wrapping_add(self.breaks)
    }

    /// It was started again, as something else than its clock says.
    pub(crate) fn restarted(&mut self) {
        *self = Epoch { breaks: self.breaks + 1, ..Epoch::new(self.jump_m) };
    }

    /// Takes in a message; `Err` if it was overtaken by newer ones and must not be taken in by others either.
    pub(crate) fn take_in(&mut self, heard: &Heard, vehicle: &Vehicle, now: Time) -> Result<Option<Break>, Overtaken> {
        let boot_ms = match heard {
            Heard::LocalPosition(it) => Some(it.boot_ms),
            Heard::GlobalPosition(it) => Some(it.boot_ms),
            Heard::SystemTime(boot_ms) => Some(*boot_ms),
            _ => None,
        };
        if let Some(boot_ms) = boot_ms {
            match self.boot_ms {
                Some(newest) if boot_ms < newest => {
                    let is_late = newest - boot_ms <= OVERTAKEN_MS;
                    self.older += 1;
                    // A delayed message keeps within its limit; of a new start each one is far behind.
                    if is_late || self.older < RESTARTED_AFTER {
                        return if is_overtaken(heard, &self.position) { Err(Overtaken) } else { Ok(None) };
                    }
                    self.restarted();
                    self.boot_ms = Some(boot_ms);
                    return Ok(Some(Break::Restart));
                }
                _ => (self.boot_ms, self.older) = (Some(boot_ms), 0),
            }
        }
        Ok(self.moved(heard, vehicle, now).map(|how| {
            self.breaks += 1;
            Break::Moved(how)
        }))
    }

    fn moved(&mut self, heard: &Heard, vehicle: &Vehicle, now: Time) -> Option<String> {
        match heard {
            Heard::Origin(it) => {
                let before = self.origin.replace(*it)?;
                // The number follows from the origin: it need not be counted, but it must be said.
                (before != *it)
                    .then(|| format!("the origin of the local frame has moved by {:.0} m", apart_m(before, *it)))
            }
            Heard::Home(it) => {
                let before = self.home.replace(*it)?;
                let is_recent = |since: Time| now - since <= SETTLES;
                let is_begun = vehicle.armed_since.is_none_or(is_recent) || vehicle.lifted_off.is_some_and(is_recent);
                let is_settling = is_begun || vehicle.is_on_ground();
                let moved_m = apart_m(before, *it);
                (!is_settling && HOME_MOVED_M < moved_m).then(|| format!("home was moved by {moved_m:.0} m in flight"))
            }
            Heard::LocalPosition(it) => {
                let (before_ms, before) = self.position.replace((it.boot_ms, *it))?;
                let dt_s = f64::from(it.boot_ms.saturating_sub(before_ms)) / 1e3;
                let speed_m_s = length(before.velocity).max(length(it.velocity));
                let distance_m = length(difference(it.position, before.position));
                let is_jump = self.jump_m + 2.0 * speed_m_s * dt_s < distance_m;
                is_jump.then(|| format!("the position has jumped by {distance_m:.0} m"))
            }
            _ => None,
        }
    }
}

/// A message that newer ones have overtaken.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Overtaken;

/// Of messages that carry a position only the newest of each kind counts.
fn is_overtaken(heard: &Heard, position: &Option<(u32, LocalPosition)>) -> bool {
    match heard {
        Heard::LocalPosition(it) => position.is_some_and(|(newest, _)| it.boot_ms <= newest),
        _ => false,
    }
}

/// Over ground, in metres, of places in 1e-7 degrees; near enough for "moved or not".
fn apart_m(a: [i32; 3], b: [i32; 3]) -> f64 {
    /// Of a ten-millionth of a degree along a meridian.
    const UNIT_M: f64 = 0.011_132;
    let north = f64::from(a[0].wrapping_sub(b[0])) * UNIT_M;
    let east = f64::from(a[1].wrapping_sub(b[1])) * UNIT_M * (f64::from(a[0]) * 1e-7).to_radians().cos();
    north.hypot(east)
}
