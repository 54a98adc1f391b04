//! What has arrived at a socket from whom, and who of those are the ground stations that are sent to.
//!
//! There are a few places. One is given by something that is believed, and kept as long as that goes on: see
//! [`Arrivals::admit`]. A station that knows the key and is behind is let in where a place is free: only so it hears
//! the time that it has to sign with. What arrives from each place waits by itself, and what arrives from all others in
//! a small queue of its own; they are taken in turn, so that nobody's datagrams keep another one's out, or wait behind
//! them for long.
//!
//! Where somebody has to leave for a newcomer, it is one of the address that has the most (as with the seats of the gateway): a stranger with
//! many ports displaces himself. Addresses can be made up, so that this does not protect without signatures.

use std::cmp::Reverse;
use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use domain::time::Time;

use crate::link::Voice;

/// Ground stations that are sent to at once.
const MOST_STATIONS: usize = 4;
/// After this silence a ground station is no longer sent to: it says at least once a second that it is there.
const STATION_GONE: Duration = Duration::from_secs(30);
/// After this silence, a few of its heartbeats, it leaves for a newcomer of its own address: those who speak do not displace each other.
const STATION_SILENT: Duration = Duration::from_secs(3);
/// Datagrams of one station that wait: a quarter of a second of full rates.
const MOST_OF_ONE: usize = 128;
/// Datagrams that wait of all who have no place.
const MOST_OF_OTHERS: usize = 32;

/// Who sends to a socket, and what was not taken yet.
#[derive(Debug)]
pub(super) struct Arrivals {
    stations: Vec<Station>,
    /// Others may become stations.
    is_open: bool,
    others: VecDeque<(SocketAddr, Vec<u8>)>,
    /// Whose turn it is: a station's, or after the last that of the others.
    turn: usize,
    /// Who sent what was taken last.
    last: Option<SocketAddr>,
}

#[derive(Debug)]
struct Station {
    address: SocketAddr,
    heard: Time,
    /// Otherwise it is only let in to hear, and what it says goes no further.
    is_believed: bool,
    waiting: VecDeque<Vec<u8>>,
}

impl Arrivals {
    /// Anybody may become a station.
    pub(super) fn of_any() -> Arrivals {
        Arrivals { stations: Vec::new(), is_open: true, others: VecDeque::new(), turn: 0, last: None }
    }

    /// This is the only station, whether it speaks or not.
    pub(super) fn of_only(address: SocketAddr) -> Arrivals {
        let station = Station { address, heard: Time::ZERO, is_believed: true, waiting: VecDeque::new() };
        Arrivals { stations: vec![station], is_open: false, ..Arrivals::of_any() }
    }

    /// A datagram has arrived; whether it waits to be taken.
    pub(super) fn put(&mut self, from: SocketAddr, bytes: &[u8]) -> bool {
        if let Some(station) = self.stations.iter_mut().find(|it| it.address == from) {
            let has_room = station.waiting.len() < MOST_OF_ONE;
            if has_room {
                station.waiting.push_back(bytes.to_vec());
            }
            return has_room;
        }
        if !self.is_open {
            return false;
        }
        if MOST_OF_OTHERS <= self.others.len() {
            let waiting = self.others.iter().enumerate().map(|(index, (address, _))| (host(*address), index));
            let Some(displaced) = displaced(&waiting.collect::<Vec<_>>(), host(from)) else { return false };
            self.others.remove(displaced);
        }
        self.others.push_back((from, bytes.to_vec()));
        true
    }

    /// The next datagram.
    pub(super) fn take(&mut self) -> Option<Vec<u8>> {
        let queues = self.stations.len() + 1;
        for turn in (self.turn..self.turn + queues).map(|it| it % queues) {
            let taken = match self.stations.get_mut(turn) {
                Some(station) => station.waiting.pop_front().map(|bytes| (station.address, bytes)),
                None => self.others.pop_front(),
            };
            if let Some((from, bytes)) = taken {
                (self.turn, self.last) = (turn + 1, Some(from));
                return Some(bytes);
            }
        }
        None
    }

    /// Whether the sender of the datagram that was taken last is listened to. A place is given and kept by what is believed; what is late
    /// gives one only to hear, and keeps no other.
    pub(super) fn admit(&mut self, voice: Voice, now: Time) -> bool {
        let Some(from) = self.last else { return false };
        if self.is_open {
            self.stations.retain(|it| it.is_present(now));
        }
        if let Some(station) = self.stations.iter_mut().find(|it| it.address == from) {
            station.speaks(voice, now);
            return station.is_believed;
        }
        if voice == Voice::Unknown || !self.is_open || !self.has_room(from, voice, now) {
            return false;
        }
        let is_believed = voice == Voice::Believed;
        // Its datagrams that wait among the others would be overtaken there, and then be too old to be believed.
        let (own, others): (VecDeque<_>, _) = self.others.drain(..).partition(|(address, _)| *address == from);
        self.others = others;
        let waiting = own.into_iter().map(|(_, bytes)| bytes).collect();
        self.stations.push(Station { address: from, heard: now, is_believed, waiting });
        is_believed
    }

    /// Whether a place is free for a newcomer, or is now, since somebody has left for it.
    fn has_room(&mut self, newcomer: SocketAddr, voice: Voice, now: Time) -> bool {
        if self.stations.len() < MOST_STATIONS {
            return true;
        }
        let leaves = match voice {
            Voice::Believed => self.only_let_in().or_else(|| self.displaced_by(newcomer, now)),
            _ => self.displaced_by(newcomer, now).filter(|it| host(self.stations[*it].address) == host(newcomer)),
        };
        leaves.map(|it| self.stations.remove(it)).is_some()
    }

    /// The first to leave for who is believed.
    fn only_let_in(&self) -> Option<usize> {
        let let_in = self.stations.iter().enumerate().filter(|(_, it)| !it.is_believed);
        let_in.min_by_key(|(_, it)| it.heard).map(|(index, _)| index)
    }

    fn displaced_by(&self, newcomer: SocketAddr, now: Time) -> Option<usize> {
        let seated: Vec<_> = self.stations.iter().map(|it| (host(it.address), (it.is_believed, it.heard))).collect();
        let is_free_for = |it: &Station| host(it.address) != host(newcomer) || STATION_SILENT <= now - it.heard;
        displaced(&seated, host(newcomer)).filter(|it| is_free_for(&self.stations[*it]))
    }

    /// Who is sent to.
    pub(super) fn present(&self, now: Time) -> Vec<SocketAddr> {
        let present = self.stations.iter().filter(|it| !self.is_open || it.is_present(now));
        present.map(|it| it.address).collect()
    }
}

impl Station {
    fn speaks(&mut self, voice: Voice, now: Time) {
        // Who repeats what a station said, in its name, does not keep its place.
        if voice == Voice::Believed || (voice == Voice::Late && !self.is_believed) {
            self.heard = now;
        }
        self.is_believed |= voice == Voice::Believed;
    }

    fn is_present(&self, now: Time) -> bool {
        now - self.heard < STATION_GONE
    }
}

/// Without its port; an IPv4 address that is written as one of IPv6 is the same.
fn host(address: SocketAddr) -> IpAddr {
    address.ip().to_canonical()
}

/// Who leaves for a newcomer: the oldest of the address that would have the most with it, the newcomer's own if another has as many.
/// Nobody leaves who is the only one of his address.
fn displaced<Age: Ord + Copy>(seated: &[(IpAddr, Age)], newcomer: IpAddr) -> Option<usize> {
    let count = |host: IpAddr| seated.iter().filter(|(it, _)| *it == host).count();
    let rank = |(host, age): (IpAddr, Age)| {
        let is_own = host == newcomer;
        (count(host) + usize::from(is_own), is_own, Reverse(age))
    };
    let (index, (host, _)) = seated.iter().enumerate().max_by_key(|(_, it)| rank(**it))?;
    (1 < count(*host)).then_some(index)
}

#[cfg(test)]
mod tests;
