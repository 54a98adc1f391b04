//! An item of a plan, however its file writes it.

use domain::geodesy::LatLon;

use crate::content::{Height, Place, Reference};
use crate::findings::Wrong;
use crate::json::Node;

/// `MAV_FRAME_MISSION`: of an item without a place.
pub(super) const NO_PLACE: i64 = 2;
/// `MAV_FRAME_GLOBAL_RELATIVE_ALT`: heights are above the take-off point.
pub(super) const RELATIVE: i64 = 3;
/// `MAV_FRAME_GLOBAL`: heights are above mean sea level.
pub(super) const SEA_LEVEL: i64 = 0;

/// An item.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Item {
    /// Its place in the file.
    pub(super) place: String,
    /// The number by which a jump names it.
    pub(super) id: Option<i64>,
    /// `MAV_CMD`.
    pub(super) command: i64,
    /// `MAV_FRAME`.
    pub(super) frame: i64,
    /// The seven parameters; 5 to 7 are latitude, longitude and altitude where the command has a place.
    pub(super) params: [Option<f64>; 7],
    /// The autopilot stays there until a person sends it on.
    pub(super) is_last_by_itself: bool,
}

impl Item {
    /// An item of these values, which belongs to what stands at `place`.
    pub(super) fn of(place: &str, command: i64, frame: i64, params: [f64; 7]) -> Item {
        let params = params.map(Some);
        Item { place: place.to_owned(), id: None, command, frame, params, is_last_by_itself: false }
    }

    /// A `SimpleItem`. Until 2016 its parameters were members `param1` to `param4` and its place a list `coordinate`.
    pub(super) fn of_json(node: &Node<'_>) -> Result<Item, Wrong> {
        let number = |it: &Node<'_>| if it.value.is_null() { Ok(None) } else { it.number().map(Some) };
        let mut params: Vec<Option<f64>> = match node.get("params") {
            Some(list) => list.items()?.iter().map(number).collect::<Result<_, _>>()?,
            None => {
                let param = |key: &str| node.need(key).and_then(|it| it.number()).map(Some);
                ["param1", "param2", "param3", "param4"].into_iter().map(param).collect::<Result<_, _>>()?
            }
        };
        if let Some(coordinate) = node.get("coordinate") {
            params.extend(coordinate.items()?.iter().map(number).collect::<Result<Vec<_>, _>>()?);
        }
        let count = params.len();
        let params = <[Option<f64>; 7]>::try_from(params);
        let params = params.map_err(|_| Wrong::at(&node.place, format!("{count} parameters, expected 7"), ""))?;
        let item = Item {
            place: node.place.clone(),
            id: node.get("doJumpId").or_else(|| node.get("id")).map(|it| it.whole()).transpose()?,
            command: node.need("command")?.whole()?,
            frame: node.need("frame")?.whole()?,
            params,
            is_last_by_itself: !node.get("autoContinue").map_or(Ok(true), |it| it.boolean())?,
        };
        item.agrees_with(node.get("AltitudeMode"))?;
        Ok(item)
    }

    /// QGroundControl also names what the altitude is counted from (`QGroundControlQmlGlobal::AltMode`); the frame is what an
    /// autopilot gets.
    fn agrees_with(&self, mode: Option<Node<'_>>) -> Result<(), Wrong> {
        let Some(mode) = mode.filter(|_| self.frame != NO_PLACE) else { return Ok(()) };
        let frames = match mode.whole()? {
            1 => [RELATIVE, 6],
            // Above the terrain, as QGroundControl has converted it.
            2 | 3 => [SEA_LEVEL, 5],
            4 => [10, 11],
            _ => return Ok(()),
        };
        if frames.contains(&self.frame) {
            return Ok(());
        }
        let message = format!("altitude mode {} does not fit frame {}", mode.value, self.frame);
        Err(Wrong::at(&mode.place, message, "open the plan in QGroundControl and set the altitude of the item again"))
    }

    /// A parameter, counted from 1; 0 if it is not given.
    pub(super) fn param(&self, number: usize) -> f64 {
        self.given(number).unwrap_or(0.0)
    }

    /// The same; `None` if it is not given.
    pub(super) fn given(&self, number: usize) -> Option<f64> {
        self.params[number - 1]
    }

    /// Whether it gives latitude and longitude.
    pub(super) fn has_place(&self) -> bool {
        self.param(5) != 0.0 || self.param(6) != 0.0
    }

    /// Its place. Without one it means where the vehicle is, as it does on ArduPilot for 0/0, and on PX4 for a place that is not given.
    pub(super) fn at(&self) -> Result<Place, Wrong> {
        if !self.has_place() {
            return Ok(Place::Here);
        }
        match (self.given(5), self.given(6)) {
            (Some(latitude), Some(longitude)) => {
                let place = LatLon::new(latitude, longitude);
                Ok(Place::At(place.map_err(|error| Wrong::at(&self.place, error.to_string(), ""))?))
            }
            _ => Err(Wrong::at(&self.place, "a place with a latitude or a longitude alone", "")),
        }
    }

    /// How high it is flown to.
    pub(super) fn height(&self) -> Result<Height, Wrong> {
        let above = match self.frame {
            SEA_LEVEL | 5 => Reference::SeaLevel,
            RELATIVE | 6 => Reference::TakeOff,
            10 | 11 => Reference::Ground,
            other => {
                let message = format!(
                    "frame {other}, expected 0 (above sea level), 3 (above the take-off point) or 10 (above the ground)"
                );
                return Err(Wrong::at(&self.place, message, "give the item one of these frames in QGroundControl"));
            }
        };
        let metres = self.given(7).ok_or_else(|| Wrong::at(&self.place, "its altitude is not given", ""))?;
        if above != Reference::SeaLevel && metres == 0.0 {
            let message = "its altitude is 0: on ArduPilot that means the present one, on PX4 the ground";
            return Err(Wrong::at(&self.place, message, "give it the height to fly at"));
        }
        Ok(Height { metres, above })
    }
}
