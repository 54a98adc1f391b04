//! What of the decisions is on the disk, and so which grants may be published.

use std::collections::BTreeMap;

use domain::memory::{MemoryHealth, MemoryLoss};
use kittiwake_proto::v1;
use node::VehicleId;

/// How far the tower's memory can be relied on.
#[derive(Debug, Default)]
pub(crate) struct Stored {
    health: MemoryHealth,
    /// The highest number of a decision about each vehicle that is on the disk; `None` where nothing is stored.
    through: Option<BTreeMap<VehicleId, u64>>,
}

impl Stored {
    /// Decisions are stored from now on.
    pub(crate) fn begin(&mut self) {
        self.through = Some(BTreeMap::new());
    }

    pub(crate) fn health(&self) -> &MemoryHealth {
        &self.health
    }

    /// Decisions of a process before are lost.
    pub(crate) fn lost(&mut self, loss: MemoryLoss) {
        self.health.loss = Some(loss);
    }

    /// The outcome of the newest attempt to save; see [`MemoryHealth::written`].
    pub(crate) fn written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        self.health.written(outcome, loss);
    }

    /// These decisions are on the disk.
    pub(crate) fn saved(&mut self, ledgers: &[v1::LedgerMemory]) {
        let through = |it: &v1::LedgerMemory| (it.vehicle.as_str().into(), it.last_decision);
        self.through = Some(ledgers.iter().map(through).collect());
    }

    /// Whether the grant of this number is given for good: no tower that is started again has forgotten it, nor a decision
    /// before it.
    pub(crate) fn has(&self, vehicle: &VehicleId, decision: u64) -> bool {
        let is_saved = |through: &BTreeMap<_, _>| through.get(vehicle).is_some_and(|last| decision <= *last);
        self.health.loss.is_none() && self.through.as_ref().is_none_or(is_saved)
    }

    /// Whether an operator may grant.
    ///
    /// # Errors
    /// Why not, and what to do.
    pub(crate) fn may_grant(&self) -> Result<(), String> {
        if let Some(MemoryLoss { why, .. }) = &self.health.loss {
            return Err(format!(
                "earlier decisions of the tower are lost ({why}): nothing is granted before an operator accepts that \
                 with `kittiwake permission accept-loss`"
            ));
        }
        self.is_writable()
    }

    /// An operator lets the tower grant without what is lost.
    ///
    /// # Errors
    /// If there is nothing to accept, or what is decided from now on could not be stored either.
    pub(crate) fn accept_loss(&mut self) -> Result<(), String> {
        if self.health.loss.is_none() {
            return Err("nothing to accept: the tower knows its earlier decisions".to_owned());
        }
        self.is_writable()?;
        self.health.loss = None;
        Ok(())
    }

    fn is_writable(&self) -> Result<(), String> {
        match &self.health.failing {
            None => Ok(()),
            Some(why) => Err(format!("a grant could not be stored, so none is given: {why}; make it writable")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grant_is_given_for_good_once_it_is_stored_and_nothing_is_lost() {
        #[track_caller]
        fn check(prepare: impl Fn(&mut Stored), expected: bool) {
            let mut stored = Stored::default();
            prepare(&mut stored);
            assert_eq!(stored.has(&"uav1".into(), 5), expected);
        }
        fn saved(stored: &mut Stored, vehicle: &str, last_decision: u64) {
            let vehicle = vehicle.to_owned();
            stored.saved(&[v1::LedgerMemory { vehicle, last_decision, ..Default::default() }]);
        }
        let loss = || MemoryLoss { id: 1, why: "it is garbled".into() };
        check(|_| {}, true);
        check(Stored::begin, false);
        check(|it| saved(it, "uav1", 4), false);
        check(|it| saved(it, "uav1", 5), true);
        check(|it| saved(it, "uav2", 5), false);
        check(
            |it| {
                saved(it, "uav1", 5);
                it.lost(loss());
            },
            false,
        );
        check(
            |it| {
                saved(it, "uav1", 5);
                it.lost(loss());
                it.accept_loss().unwrap();
            },
            true,
        );
    }

    #[test]
    fn a_loss_is_accepted_only_where_there_is_one_and_the_disk_works_again() {
        let mut stored = Stored::default();
        assert!(stored.accept_loss().unwrap_err().starts_with("nothing to accept"));
        stored.lost(MemoryLoss { id: 1, why: "it is garbled".into() });
        stored.written(Err("the disk is full".into()), None);
        assert!(stored.accept_loss().unwrap_err().contains("the disk is full"));
        assert!(stored.may_grant().unwrap_err().contains("it is garbled"));
        stored.written(Ok(()), None);
        assert_eq!((stored.accept_loss(), stored.may_grant()), (Ok(()), Ok(())));
    }
}
