//! Missions that nobody designed, and the ground under them: one to three objectives among areas, sites, water and people.

use std::fmt::Write;
use std::time::{Duration, SystemTime};

use domain::file::Source;
use domain::mission::Mission;
use node::virtual_bus::UTC_START_MS;
use vehicle_sim::ground::{Ground, Patch, Surface};

use super::dice::Dice;
use crate::PLACE_M;

/// Of a hundred missions, objectives or sites this many have it.
mod share {
    /// Every place to land at is a deck above the sea.
    pub(super) const DECKS: u64 = 20;
    /// All distances are three times as long.
    pub(super) const FAR: u64 = 10;
    /// The mission names water or people on the ground.
    pub(super) const BAD_GROUND: u64 = 35;
    /// The mission is flown in a volume.
    pub(super) const VOLUME: u64 = 20;
    /// A permission area holds the take-off point.
    pub(super) const HOME_AREA: u64 = 20;
    /// Of the objectives: on the ground, with a stay; of those in flight: a drop, a survey.
    pub(super) const ON_GROUND: u64 = 40;
    pub(super) const STAY: u64 = 25;
    pub(super) const DROP: u64 = 15;
    pub(super) const SURVEY: u64 = 12;
    /// Of the sites: one to ditch at.
    pub(super) const DITCH: u64 = 25;
}
/// Heights of places to land at, above the take-off point.
const GROUND_M: [i64; 8] = [0, 0, 0, -5, 4, 15, 35, 60];
/// Heights of objectives in flight.
const FLIGHT_M: [i64; 5] = [15, 15, 15, 30, 60];
/// Lengths of stays.
const STAYS_S: [i64; 5] = [10, 30, 90, 300, 900];
/// Ceilings of volumes; 0: none.
const CEILINGS_M: [i64; 4] = [0, 40, 60, 100];
/// How far the sea is below a deck.
const SEA_M: f64 = -15.0;

/// A mission that is not refused, and what belongs to it.
#[derive(Debug)]
pub(super) struct Drawn {
    /// As a file.
    pub(super) text: String,
    /// The same without areas and volume.
    pub(super) bare: String,
    /// The names of its areas.
    pub(super) areas: Vec<String>,
    /// The ground, as the file says it and with what the file does not say.
    pub(super) ground: Ground,
    /// Where it may land, north, east and height.
    pub(super) places: Vec<[i64; 3]>,
}

pub(super) fn random_mission(dice: &mut Dice) -> Drawn {
    loop {
        let draft = Draft::draw(dice);
        if !draft.agrees_with_itself() {
            continue;
        }
        let text = format!("{}{}", draft.bare, draft.areas);
        if let Ok(mission) = Mission::read(&Source { path: "random.toml".into(), text: text.clone() }) {
            let areas = mission.areas.into_iter().map(|it| it.name).collect();
            return Drawn { text, bare: draft.bare, areas, ground: draft.ground, places: draft.places };
        }
    }
}

struct Draft<'a> {
    dice: &'a mut Dice,
    /// Name, objectives and sites.
    bare: String,
    areas: String,
    ground: Ground,
    places: Vec<[i64; 3]>,
    /// Where it flies, north and east, and how high.
    flights: Vec<([i64; 2], [i64; 2], i64)>,
    /// All distances are multiplied by it.
    times: i64,
    decks: bool,
}

impl<'a> Draft<'a> {
    fn draw(dice: &'a mut Dice) -> Draft<'a> {
        let (decks, far) = (dice.sometimes(share::DECKS), dice.sometimes(share::FAR));
        let (bare, times) = ("name = \"random\"\n".to_owned(), if far { 3 } else { 1 });
        let ground = Ground::default();
        let mut draft =
            Draft { dice, bare, areas: String::new(), ground, places: Vec::new(), flights: Vec::new(), times, decks };
        draft.objectives();
        (0..draft.dice.below(4)).for_each(|number| draft.site(number));
        if draft.dice.sometimes(share::BAD_GROUND) && !decks {
            draft.bad_ground();
        }
        draft.ground_at_places();
        (1..=draft.dice.below(5)).for_each(|number| draft.area(number));
        if draft.dice.sometimes(share::HOME_AREA) {
            let side = draft.dice.between(60, 160);
            draft.rectangle("home-area", "permission", [-side, side], [-side, side]);
        }
        if draft.dice.sometimes(share::VOLUME) {
            draft.volume();
        }
        draft
    }

    fn objectives(&mut self) {
        for number in 1..=self.dice.between(1, 3) {
            let (north, east) = (self.dice.between(-200, 200) * self.times, self.dice.between(60, 700) * self.times);
            self.objective(&format!("place-{number}"), north, east);
        }
        match self.dice.below(10) {
            0 => {}
            1 => {
                let (north, east) = (self.dice.between(-300, 300), self.dice.between(100, 600));
                self.landing("elsewhere", north, east, 0);
            }
            _ => self.landing("return", 0, 0, 0),
        }
    }

    fn objective(&mut self, name: &str, north: i64, east: i64) {
        let height = match self.dice.sometimes(share::ON_GROUND) {
            true => {
                let height = self.dice.one_of(&GROUND_M);
                self.landing(name, north, east, height);
                return self.stay();
            }
            false => self.dice.one_of(&FLIGHT_M),
        };
        let _ = writeln!(self.bare, "[[objective]]\nname = \"{name}\"\nheight_m = {height}\nflying = true");
        if self.dice.sometimes(share::SURVEY) {
            let (to_north, to_east) = (north + self.dice.between(40, 120), east + self.dice.between(40, 120));
            let corners =
                format!("[[{north}, {east}], [{to_north}, {east}], [{to_north}, {to_east}], [{north}, {to_east}]]");
            self.flights.push(([north, to_north], [east, to_east], height));
            let _ = writeln!(self.bare, "survey = {{ corners_m = {corners}, spacing_m = 30 }}");
        } else {
            self.flights.push(([north; 2], [east; 2], height));
            let _ = writeln!(self.bare, "north_m = {north}\neast_m = {east}");
        }
        if self.dice.sometimes(share::DROP) {
            self.bare.push_str("drop = true\n");
        }
        self.stay();
    }

    fn stay(&mut self) {
        if self.dice.sometimes(share::STAY) {
            let stay_s = self.dice.one_of(&STAYS_S);
            let _ = writeln!(self.bare, "dwell_s = {stay_s}");
        }
    }

    /// An objective on the ground.
    fn landing(&mut self, name: &str, north: i64, east: i64, height: i64) {
        let _ = writeln!(
            self.bare,
            "[[objective]]\nname = \"{name}\"\nnorth_m = {north}\neast_m = {east}\nheight_m = {height}\nflying = false"
        );
        self.places.push([north, east, height]);
    }

    fn site(&mut self, number: u64) {
        let ditch = self.dice.sometimes(share::DITCH);
        let (north, east) = (self.dice.between(-300, 300) * self.times, self.dice.between(0, 700) * self.times);
        let height = if ditch { 0 } else { self.dice.one_of(&GROUND_M) };
        let kind = if ditch { "ditch" } else { "landing" };
        let _ = writeln!(
            self.bare,
            "[[site]]\nname = \"site-{number}\"\nkind = \"{kind}\"\nnorth_m = {north}\neast_m = {east}\nheight_m = {height}"
        );
        match ditch {
            true => self.patch(north, east, 0.0, Surface::Water),
            false => self.places.push([north, east, height]),
        }
    }

    fn patch(&mut self, north: i64, east: i64, height_m: f64, surface: Surface) {
        self.ground.patches.push(Patch::square((north as f64, east as f64), PLACE_M, height_m, surface));
    }

    /// A pond, or a crowd.
    fn bad_ground(&mut self) {
        let (surface, name) = self.dice.one_of(&[(Surface::Water, "pond"), (Surface::People, "crowd")]);
        let (north, east) = (self.dice.between(-250, 250) * self.times, self.dice.between(-20, 600) * self.times);
        let (half_north, half_east) = (self.dice.between(50, 300), self.dice.between(50, 300));
        let (north, east) = ([north - half_north, north + half_north], [east - half_east, east + half_east]);
        self.rectangle(name, "no-landing", north, east);
        let _ = writeln!(self.areas, "ground = \"{surface}\"");
        let metres = |[from, to]: [i64; 2]| [from as f64, to as f64];
        self.ground.patches.push(Patch { north_m: metres(north), east_m: metres(east), height_m: 0.0, surface });
    }

    /// What is under the places to land at; and the sea around decks.
    fn ground_at_places(&mut self) {
        self.places.push([0, 0, 0]);
        for [north, east, height] in self.places.clone() {
            self.patch(north, east, height as f64, Surface::Land);
        }
        if self.decks {
            (self.ground.elsewhere_m, self.ground.elsewhere) = (SEA_M, Surface::Water);
            self.rectangle("sea", "no-landing", [-4000, 4000], [-4000, 4000]);
            self.areas.push_str("ground = \"water\"\n");
            let half = PLACE_M as i64 / 2;
            let mut around = self.places.clone();
            around.sort_unstable();
            around.dedup_by_key(|[north, east, _]| (*north, *east));
            let square =
                |[north, east, _]: &[i64; 3]| corners([north - half, north + half], [east - half, east + half]);
            let holes: Vec<String> = around.iter().map(square).collect();
            let _ = writeln!(self.areas, "holes_m = [{}]", holes.join(", "));
        }
    }

    /// No place lies on the ground of another one, at another height, and nothing is flown to inside the ground.
    fn agrees_with_itself(&self) -> bool {
        let near = |a: &[i64; 3], b: &[i64; 3]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) < 2 * PLACE_M as i64;
        let within = |[from, to]: [i64; 2], it: i64| (from - PLACE_M as i64..=to + PLACE_M as i64).contains(&it);
        let is_inside = |place: &[i64; 3]| {
            let flights = self.flights.iter().filter(|(.., height)| *height <= place[2]);
            flights.into_iter().any(|(north, east, _)| within(*north, place[0]) && within(*east, place[1]))
        };
        let agree = |a: &[i64; 3]| self.places.iter().all(|b| a[2] == b[2] || !near(a, b));
        self.places.iter().all(|it| agree(it) && !is_inside(it))
    }

    fn rectangle(&mut self, name: &str, kind: &str, north: [i64; 2], east: [i64; 2]) {
        let corners = corners(north, east);
        let _ = writeln!(self.areas, "[[area]]\nname = \"{name}\"\nkind = \"{kind}\"\ncorners_m = {corners}");
    }

    fn area(&mut self, number: u64) {
        let kind = self.dice.one_of(&["permission", "permission", "keep-out"]);
        let (north, east) = (self.dice.between(-200, 200), self.dice.between(-20, 700) * self.times);
        let (half_north, half_east) = (self.dice.between(20, 180), self.dice.between(20, 120));
        let (north, east) = ([north - half_north, north + half_north], [east - half_east, east + half_east]);
        self.rectangle(&format!("area-{number}"), kind, north, east);
        match self.dice.below(6) {
            0 => self.areas.push_str("ceiling_m = 12\n"),
            1 => self.areas.push_str("floor_m = 25\n"),
            2 => self.areas.push_str("ceiling_m = 60\n"),
            _ => {}
        }
        let utc = |seconds: i64| {
            let since = Duration::from_millis(UTC_START_MS as u64) + Duration::from_secs(seconds as u64);
            humantime::format_rfc3339_seconds(SystemTime::UNIX_EPOCH + since)
        };
        if self.dice.sometimes(30) {
            let (from, lasts) = (self.dice.between(1, 300), self.dice.between(30, 300));
            let _ = writeln!(self.areas, "from_utc = \"{}\"\nuntil_utc = \"{}\"", utc(from), utc(from + lasts));
        } else if self.dice.sometimes(20) {
            let until = self.dice.between(20, 300);
            let _ = writeln!(self.areas, "until_utc = \"{}\"", utc(until));
        }
    }

    fn volume(&mut self) {
        let (beyond, ceiling) = (self.dice.between(60, 250), self.dice.one_of(&CEILINGS_M));
        let (north, east) = (320 * self.times + beyond, 720 * self.times + beyond);
        let corners = corners([-north, north], [-beyond, east]);
        let _ = writeln!(self.areas, "[volume]\ncorners_m = {corners}");
        if 0 < ceiling {
            let _ = writeln!(self.areas, "ceiling_m = {ceiling}");
        }
    }
}

fn corners([south, north]: [i64; 2], [west, east]: [i64; 2]) -> String {
    format!("[[{south}, {west}], [{north}, {west}], [{north}, {east}], [{south}, {east}]]")
}
