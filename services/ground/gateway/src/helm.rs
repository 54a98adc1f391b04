//! Who holds command of which vehicle: one operator at a time, taken and released, or handed over.
//!
//! Command lapses when its holder has not been heard of for a while, so that an operator who has
//! left does not lock the others out.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// The helms of all vehicles, shared by all who ask.
#[derive(Debug)]
pub struct Helms {
    lease: Duration,
    by_vehicle: Mutex<BTreeMap<String, Held>>,
}

#[derive(Debug, Clone)]
struct Held {
    holder: Arc<str>,
    offered_to: Option<String>,
    heard: Instant,
}

/// Who holds command of a vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Helm {
    /// Nobody, if `None`.
    pub holder: Option<Arc<str>>,
    /// Who may take it from the holder.
    pub offered_to: Option<String>,
}

impl Helm {
    /// As a document.
    pub fn to_json(&self) -> Value {
        json!({ "holder": self.holder.as_deref(), "offeredTo": self.offered_to })
    }
}

impl Helms {
    /// Nobody holds anything. Command lapses after `lease` without a sign of its holder.
    pub fn new(lease: Duration) -> Helms {
        Helms { lease, by_vehicle: Mutex::default() }
    }

    /// Who holds command of `vehicle`.
    pub fn of(&self, vehicle: &str, now: Instant) -> Helm {
        self.held(&mut self.lock(), vehicle, now).map_or_else(Helm::default, |it| Helm {
            holder: Some(it.holder.clone()),
            offered_to: it.offered_to.clone(),
        })
    }

    /// `who` was heard of.
    pub fn heard(&self, who: &str, now: Instant) {
        self.lock().values_mut().filter(|it| &*it.holder == who).for_each(|it| it.heard = now);
    }

    /// Takes command, if nobody else holds it or it was offered.
    ///
    /// # Errors
    /// Who holds it.
    pub fn take(&self, vehicle: &str, who: &Arc<str>, now: Instant) -> Result<(), String> {
        let mut helms = self.lock();
        if let Some(held) = self.held(&mut helms, vehicle, now) {
            let may = held.holder == *who || held.offered_to.as_deref() == Some(&**who);
            if !may {
                return Err(format!("{} holds command of {vehicle}", held.holder));
            }
        }
        helms.insert(vehicle.to_owned(), Held { holder: who.clone(), offered_to: None, heard: now });
        Ok(())
    }

    /// Gives command back.
    ///
    /// # Errors
    /// Who holds it instead.
    pub fn release(&self, vehicle: &str, who: &str, now: Instant) -> Result<(), String> {
        let mut helms = self.lock();
        self.held_by(&mut helms, vehicle, who, now)?;
        helms.remove(vehicle);
        Ok(())
    }

    /// Lets `to` take command; until then the holder keeps it.
    ///
    /// # Errors
    /// Who holds it instead.
    pub fn hand_over(&self, vehicle: &str, who: &str, to: &str, now: Instant) -> Result<(), String> {
        self.held_by(&mut self.lock(), vehicle, who, now)?.offered_to = Some(to.to_owned());
        Ok(())
    }

    /// Whether `who` holds command.
    ///
    /// # Errors
    /// Who holds it instead.
    pub fn check(&self, vehicle: &str, who: &str, now: Instant) -> Result<(), String> {
        self.held_by(&mut self.lock(), vehicle, who, now).map(|_| ())
    }

    fn held<'a>(&self, helms: &'a mut BTreeMap<String, Held>, vehicle: &str, now: Instant) -> Option<&'a mut Held> {
        helms.get_mut(vehicle).filter(|it| now.saturating_duration_since(it.heard) < self.lease)
    }

    fn held_by<'a>(
        &self,
        helms: &'a mut BTreeMap<String, Held>,
        vehicle: &str,
        who: &str,
        now: Instant,
    ) -> Result<&'a mut Held, String> {
        match self.held(helms, vehicle, now) {
            Some(held) if &*held.holder == who => Ok(held),
            Some(held) => Err(format!("{} holds command of {vehicle}", held.holder)),
            None => Err(format!("nobody holds command of {vehicle}; take it first")),
        }
    }

    /// Plain data: a thread that panicked while it held the lock has left it whole.
    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Held>> {
        self.by_vehicle.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEASE: Duration = Duration::from_secs(60);

    #[test]
    fn one_at_a_time_until_it_is_released_handed_over_or_lapses() {
        let (helms, start) = (Helms::new(LEASE), Instant::now());
        let (anna, ben): (Arc<str>, Arc<str>) = ("anna".into(), "ben".into());
        let taken = Err("anna holds command of uav1".to_owned());
        assert_eq!(helms.check("uav1", "anna", start), Err("nobody holds command of uav1; take it first".into()));
        assert_eq!(helms.take("uav1", &anna, start), Ok(()));
        assert_eq!(helms.take("uav1", &anna, start), Ok(()));
        assert_eq!(helms.take("uav1", &ben, start), taken);
        assert_eq!(helms.take("uav2", &ben, start), Ok(()));
        assert_eq!(helms.release("uav1", "ben", start), taken);
        assert_eq!(helms.hand_over("uav1", "ben", "ben", start), taken);
        // Offered, not given: the vehicle is never without a commander.
        assert_eq!(helms.hand_over("uav1", "anna", "ben", start), Ok(()));
        assert_eq!(helms.check("uav1", "anna", start), Ok(()));
        assert_eq!(helms.take("uav1", &ben, start), Ok(()));
        assert_eq!(helms.of("uav1", start), Helm { holder: Some(ben.clone()), offered_to: None });
        assert_eq!(helms.release("uav1", "ben", start), Ok(()));
        assert_eq!(helms.take("uav1", &anna, start), Ok(()));
        helms.heard("anna", start + LEASE / 2);
        assert_eq!(helms.take("uav1", &ben, start + LEASE), taken);
        assert_eq!(helms.take("uav1", &ben, start + LEASE * 3 / 2), Ok(()));
    }
}
