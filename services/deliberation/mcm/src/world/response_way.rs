//! Where the response under way leads, as operators see it: its way, its destination, and the time to its end.

use domain::geometry::Ned;
use domain::skill::Goal;
use kittiwake_proto::v1;

use super::World;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ResponseWay {
    /// From the end of the leg that is flown on.
    pub(crate) points: Vec<Ned>,
    /// Where it leads, in words: `home`, `site quay`.
    pub(crate) destination: String,
    pub(crate) lands: bool,
}

impl World {
    /// The response flies this way from now on; `None`: it has ended, or holds.
    pub(crate) fn set_response_way(&mut self, way: Option<ResponseWay>) {
        self.answer.response_way = self.response_row().zip(way);
    }

    /// The published way; `None` if nothing responds, or the response stays where it is.
    pub(super) fn told_response_way(&self) -> Option<v1::ResponseWay> {
        let row = self.response_row()?;
        let here = self.seen.vehicle.filter(|it| it.flying)?.position;
        let speeds = &self.setup.limits.flight.speeds;
        let way = self.answer.response_way.as_ref().filter(|(of_row, _)| *of_row == row).map(|(_, way)| way);
        let (mut points, destination, lands) = match (way, self.skills.present()) {
            (Some(way), _) => (way.points.clone(), way.destination.clone(), way.lands),
            (None, Some((Goal::Land | Goal::LandOnTarget, _))) => (Vec::new(), "the ground below".to_owned(), true),
            (None, _) => return None,
        };
        let flight_s = speeds.time_along_s(here, &points);
        let over = points.last().copied().unwrap_or(here);
        let place = over.at_height(self.planner.mission.ground.height_m(over).min(over.height_m()));
        let down_s = if lands { speeds.time_s(over, place) } else { 0.0 };
        if lands {
            points.push(place);
        }
        Some(v1::ResponseWay {
            points: points.into_iter().map(Into::into).collect(),
            destination,
            lands,
            time_s: flight_s + down_s,
        })
    }
}
