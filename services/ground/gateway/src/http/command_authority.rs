//! Who has command of which vehicle: one operator at a time, who takes it and releases it or offers it to another.
//!
//! Command lapses when its holder has made no request for a while, or may not command any more, so that an operator who has left does not
//! lock the others out.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use kittiwake_proto::v1::CommandAuthority;

/// Command of every vehicle.
#[derive(Debug)]
pub(crate) struct CommandAuthorities {
    lease: Duration,
    by_vehicle: Mutex<BTreeMap<String, Held>>,
}

#[derive(Debug, Clone)]
struct Held {
    holder: Arc<str>,
    offered_to: Option<String>,
    heard: Instant,
}

impl CommandAuthorities {
    /// Nobody has command. Command lapses after `lease` without a request of its holder.
    pub(crate) fn new(lease: Duration) -> CommandAuthorities {
        CommandAuthorities { lease, by_vehicle: Mutex::default() }
    }

    /// Who has command of `vehicle`.
    pub(crate) fn of(&self, vehicle: &str, now: Instant) -> CommandAuthority {
        let mut all = self.lock();
        let held = self.held(&mut all, vehicle, now);
        held.map_or_else(CommandAuthority::default, |held| CommandAuthority {
            holder: Some(held.holder.to_string()),
            offered_to: held.offered_to.clone(),
        })
    }

    /// `who` has made a request or follows an event stream.
    pub(crate) fn heard_from(&self, who: &str, now: Instant) {
        self.lock().values_mut().filter(|held| &*held.holder == who).for_each(|held| held.heard = now);
    }

    /// Takes command from every holder who may not have it any more.
    pub(crate) fn keep(&self, may_command: impl Fn(&str) -> bool) {
        self.lock().retain(|_, held| may_command(&held.holder));
    }

    /// Takes command, if nobody else has it or it was offered.
    ///
    /// # Errors
    /// The operator who has command.
    pub(crate) fn take(&self, vehicle: &str, who: &Arc<str>, now: Instant) -> Result<(), String> {
        let mut all = self.lock();
        if let Some(held) = self.held(&mut all, vehicle, now) {
            let may_take = held.holder == *who || held.offered_to.as_deref() == Some(&**who);
            if !may_take {
                return Err(held_by_another(&held.holder, vehicle));
            }
        }
        all.insert(vehicle.to_owned(), Held { holder: who.clone(), offered_to: None, heard: now });
        Ok(())
    }

    /// Releases command.
    ///
    /// # Errors
    /// The operator who has command instead.
    pub(crate) fn release(&self, vehicle: &str, who: &str, now: Instant) -> Result<(), String> {
        let mut all = self.lock();
        self.held_by(&mut all, vehicle, who, now)?;
        all.remove(vehicle);
        Ok(())
    }

    /// Lets `to` take command; the holder keeps it until then.
    ///
    /// # Errors
    /// The operator who has command instead.
    pub(crate) fn hand_over(&self, vehicle: &str, who: &str, to: &str, now: Instant) -> Result<(), String> {
        self.held_by(&mut self.lock(), vehicle, who, now)?.offered_to = Some(to.to_owned());
        Ok(())
    }

    /// Whether `who` has command.
    ///
    /// # Errors
    /// The operator who has command instead.
    pub(crate) fn check(&self, vehicle: &str, who: &str, now: Instant) -> Result<(), String> {
        self.held_by(&mut self.lock(), vehicle, who, now).map(|_| ())
    }

    fn held<'a>(&self, all: &'a mut BTreeMap<String, Held>, vehicle: &str, now: Instant) -> Option<&'a mut Held> {
        all.get_mut(vehicle).filter(|held| now.saturating_duration_since(held.heard) < self.lease)
    }

    fn held_by<'a>(
        &self,
        all: &'a mut BTreeMap<String, Held>,
        vehicle: &str,
        who: &str,
        now: Instant,
    ) -> Result<&'a mut Held, String> {
        match self.held(all, vehicle, now) {
            Some(held) if &*held.holder == who => Ok(held),
            Some(held) => Err(held_by_another(&held.holder, vehicle)),
            None => Err(format!("nobody has command of {vehicle}; take command first")),
        }
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Held>> {
        self.by_vehicle.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

fn held_by_another(holder: &str, vehicle: &str) -> String {
    format!("{holder} has command of {vehicle}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEASE: Duration = Duration::from_secs(60);

    #[test]
    fn one_operator_at_a_time_until_command_is_released_handed_over_or_lapses() {
        let (all, start) = (CommandAuthorities::new(LEASE), Instant::now());
        let (anna, ben): (Arc<str>, Arc<str>) = ("anna".into(), "ben".into());
        let taken = Err("anna has command of uav1".to_owned());
        assert_eq!(all.check("uav1", "anna", start), Err("nobody has command of uav1; take command first".into()));
        assert_eq!(all.take("uav1", &anna, start), Ok(()));
        assert_eq!(all.take("uav1", &anna, start), Ok(()));
        assert_eq!(all.take("uav1", &ben, start), taken);
        assert_eq!(all.take("uav2", &ben, start), Ok(()));
        assert_eq!(all.release("uav1", "ben", start), taken);
        assert_eq!(all.hand_over("uav1", "ben", "ben", start), taken);
        // Offered, not given: the vehicle always has an operator in command.
        assert_eq!(all.hand_over("uav1", "anna", "ben", start), Ok(()));
        assert_eq!(all.check("uav1", "anna", start), Ok(()));
        assert_eq!(all.take("uav1", &ben, start), Ok(()));
        assert_eq!(all.of("uav1", start), CommandAuthority { holder: Some("ben".into()), offered_to: None });
        assert_eq!(all.release("uav1", "ben", start), Ok(()));
        assert_eq!(all.take("uav1", &anna, start), Ok(()));
        all.heard_from("anna", start + LEASE / 2);
        assert_eq!(all.take("uav1", &ben, start + LEASE), taken);
        assert_eq!(all.take("uav1", &ben, start + LEASE * 3 / 2), Ok(()));
    }

    #[test]
    fn who_may_not_command_any_more_locks_nobody_out() {
        let (all, start) = (CommandAuthorities::new(LEASE), Instant::now());
        let (anna, ben): (Arc<str>, Arc<str>) = ("anna".into(), "ben".into());
        assert_eq!((all.take("uav1", &anna, start), all.take("uav2", &ben, start)), (Ok(()), Ok(())));
        all.keep(|holder| holder == "ben");
        all.heard_from("anna", start);
        assert_eq!(all.check("uav2", "ben", start), Ok(()));
        assert_eq!(all.take("uav1", &ben, start), Ok(()));
    }
}
