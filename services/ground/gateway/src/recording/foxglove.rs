//! Channels that Foxglove draws without work, beside the messages they are made of: where the vehicle is, areas, plan and the way of a
//! response on a map and in three dimensions, and the decisions as a log.
//!
//! They are JSON by the schemas of those names (<https://docs.foxglove.dev/docs/sdk/schemas>), which Foxglove knows by their names. Pure.

use std::collections::BTreeMap;

use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use kittiwake_proto::v1::AreaKind;
use serde_json::{Value, json};

/// The schemas, by their names.
const SCHEMAS: &str = include_str!("foxglove.json");
/// The frame of scenes: east, north, up from the take-off point.
const LOCAL: &str = "local";
/// Where an area has no floor or ceiling, so that it can be drawn. (ENG)
const OPEN_FLOOR_M: f64 = 0.0;
const OPEN_CEILING_M: f64 = 120.0;

const PERMISSION: [f64; 3] = [0.95, 0.65, 0.1];
const KEEP_OUT: [f64; 3] = [0.85, 0.15, 0.15];
const PLAN: [f64; 3] = [0.1, 0.45, 0.9];
const RESPONSE: [f64; 3] = [0.8, 0.1, 0.6];

/// A message of one of these channels.
#[derive(Debug, PartialEq)]
pub(crate) struct Drawing {
    pub(crate) channel: &'static str,
    /// The schema's name.
    pub(crate) schema: &'static str,
    pub(crate) message: Value,
}

/// What has been heard of a vehicle, as far as it is drawn.
#[derive(Debug, Default)]
pub(crate) struct Picture {
    origin: Option<LatLon>,
    mission: v1::MissionStatus,
    way: Vec<v1::Ned>,
    /// Of the map that was drawn last.
    drawn: String,
}

/// The text of the schema of this name.
pub(crate) fn schema(name: &str) -> String {
    let schemas: BTreeMap<String, Value> = serde_json::from_str(SCHEMAS).unwrap_or_default();
    schemas.get(name).map(ToString::to_string).unwrap_or_default()
}

impl Picture {
    /// What a message that arrived changes.
    pub(crate) fn on_message(&mut self, topic: Topic, utc_ms: i64, bytes: &[u8]) -> Vec<Drawing> {
        if !matches!(topic, Topic::Introspection | Topic::MissionStatus | Topic::McmStatus | Topic::DecisionRecord) {
            return Vec::new();
        }
        match Message::decode(topic, bytes) {
            Ok(Message::Introspection(it)) => {
                let origin = it.status.as_ref().and_then(|it| it.origin);
                self.origin = origin.and_then(|it| LatLon::new(it.latitude_deg, it.longitude_deg).ok()).or(self.origin);
                let mut drawings = position(utc_ms, &it);
                drawings.extend(self.map(utc_ms));
                drawings
            }
            Ok(Message::MissionStatus(it)) => {
                self.mission = it;
                self.map(utc_ms)
            }
            Ok(Message::McmStatus(it)) => {
                self.way = it.response_way.map(|it| it.points).unwrap_or_default();
                self.map(utc_ms)
            }
            Ok(Message::DecisionRecord(it)) => vec![log(utc_ms, &it)],
            _ => Vec::new(),
        }
    }

    /// Areas, plan and the way of a response, if they have changed.
    fn map(&mut self, utc_ms: i64) -> Vec<Drawing> {
        let Some(origin) = self.origin else { return Vec::new() };
        let lines = self.lines();
        let geojson = geojson(&LocalFrame::at(origin), &lines).to_string();
        if geojson == self.drawn {
            return Vec::new();
        }
        self.drawn.clone_from(&geojson);
        vec![
            Drawing { channel: "foxglove/map", schema: "foxglove.GeoJSON", message: json!({ "geojson": geojson }) },
            Drawing { channel: "foxglove/scene", schema: "foxglove.SceneUpdate", message: scene(utc_ms, &lines) },
        ]
    }

    fn lines(&self) -> Vec<Line> {
        let mut lines = Vec::new();
        for area in &self.mission.areas {
            let color = if area.kind() == AreaKind::KeepOut { KEEP_OUT } else { PERMISSION };
            for height_m in [area.floor_m.unwrap_or(OPEN_FLOOR_M), area.ceiling_m.unwrap_or(OPEN_CEILING_M)] {
                let places = area.corners.iter().map(|it| Ned::new(it.north_m, it.east_m, -height_m)).collect();
                lines.push(Line { name: area.name.clone(), is_closed: true, color, places });
            }
        }
        let steps = self.mission.plan.iter().flat_map(|it| &it.steps);
        let from = steps.clone().next().and_then(|it| it.from);
        let ends = steps.filter_map(|it| it.goal_state.as_ref()?.position);
        lines.push(Line::open("plan", PLAN, from.into_iter().chain(ends)));
        lines.push(Line::open("response", RESPONSE, self.way.iter().copied()));
        lines.retain(|it| 1 < it.places.len());
        lines
    }
}

/// Something that is drawn as a line.
struct Line {
    name: String,
    is_closed: bool,
    color: [f64; 3],
    places: Vec<Ned>,
}

impl Line {
    fn open(name: &str, color: [f64; 3], places: impl Iterator<Item = v1::Ned>) -> Line {
        let places = places.map(|it| Ned::new(it.north_m, it.east_m, it.down_m)).collect();
        Line { name: name.to_owned(), is_closed: false, color, places }
    }
}

fn geojson(frame: &LocalFrame, lines: &[Line]) -> Value {
    let feature = |line: &Line| {
        let place = |it: &Ned| {
            let place = frame.lat_lon(*it);
            [place.longitude_deg(), place.latitude_deg()]
        };
        let mut places: Vec<_> = line.places.iter().map(place).collect();
        let geometry = if line.is_closed {
            places.extend(places.first().copied());
            json!({ "type": "Polygon", "coordinates": [places] })
        } else {
            json!({ "type": "LineString", "coordinates": places })
        };
        let [red, green, blue] = line.color.map(|it| (it * 255.0).round() as u8);
        let style = json!({ "color": format!("#{red:02x}{green:02x}{blue:02x}"), "fillOpacity": 0.1 });
        json!({ "type": "Feature", "geometry": geometry, "properties": { "name": line.name, "style": style } })
    };
    // An area has two lines, of its floor and of its ceiling, which are one on a map.
    let is_first = |(number, line): &(usize, &Line)| !line.is_closed || number.is_multiple_of(2);
    let features: Vec<_> = lines.iter().enumerate().filter(is_first).map(|(_, it)| feature(it)).collect();
    json!({ "type": "FeatureCollection", "features": features })
}

fn scene(utc_ms: i64, lines: &[Line]) -> Value {
    let origin = json!({ "position": { "x": 0, "y": 0, "z": 0 }, "orientation": { "x": 0, "y": 0, "z": 0, "w": 1 } });
    let line = |it: &Line| {
        let points: Vec<_> = it.places.iter().map(east_north_up).collect();
        let [r, g, b] = it.color;
        json!({
            "type": if it.is_closed { 1 } else { 0 }, "pose": origin, "thickness": 2, "scale_invariant": true, "points": points,
            "color": { "r": r, "g": g, "b": b, "a": 1 }, "colors": [], "indices": [],
        })
    };
    let entity = json!({
        "timestamp": time(utc_ms), "frame_id": LOCAL, "id": "mission", "lifetime": { "sec": 0, "nsec": 0 }, "frame_locked": false,
        "metadata": [], "lines": lines.iter().map(line).collect::<Vec<_>>(), "texts": [],
    });
    json!({ "deletions": [], "entities": [entity] })
}

fn east_north_up(it: &Ned) -> Value {
    json!({ "x": it.east_m, "y": it.north_m, "z": -it.down_m })
}

fn position(utc_ms: i64, it: &v1::Introspection) -> Vec<Drawing> {
    let mut drawings = Vec::new();
    if let Some(place) = &it.global_position {
        let (horizontal, vertical) = (place.eph_m * place.eph_m, place.epv_m * place.epv_m);
        let message = json!({
            "timestamp": time(utc_ms), "frame_id": "vehicle", "latitude": place.latitude_deg, "longitude": place.longitude_deg,
            "altitude": place.altitude_amsl_m, "position_covariance": [horizontal, 0, 0, 0, horizontal, 0, 0, 0, vertical],
            // The diagonal is known.
            "position_covariance_type": 2,
        });
        drawings.push(Drawing { channel: "foxglove/location", schema: "foxglove.LocationFix", message });
    }
    if let Some(local) = &it.local_position
        && let Some(position) = &local.position
    {
        // The heading alone, counterclockwise from east.
        let half = (std::f64::consts::FRAC_PI_2 - local.heading_rad) / 2.0;
        let message = json!({
            "timestamp": time(utc_ms), "parent_frame_id": LOCAL, "child_frame_id": "vehicle",
            "translation": east_north_up(&Ned::new(position.north_m, position.east_m, position.down_m)),
            "rotation": { "x": 0, "y": 0, "z": half.sin(), "w": half.cos() },
        });
        drawings.push(Drawing { channel: "foxglove/transform", schema: "foxglove.FrameTransform", message });
    }
    drawings
}

fn log(utc_ms: i64, it: &v1::DecisionRecord) -> Drawing {
    // Information, or a warning where a flag is involved.
    let level = if it.flag.is_empty() { 2 } else { 3 };
    let reason = if it.response_reason.is_empty() { String::new() } else { format!(" ({})", it.response_reason) };
    let rejected: String = it.rejected.iter().map(|it| format!("; not {}: {}", it.what, it.why)).collect();
    let message = format!("{}{reason}{rejected}", it.text);
    let message = json!({
        "timestamp": time(utc_ms), "level": level, "message": message, "name": it.topic, "file": "", "line": it.sequence,
    });
    Drawing { channel: "foxglove/log", schema: "foxglove.Log", message }
}

fn time(utc_ms: i64) -> Value {
    let utc_ms = utc_ms.max(0);
    json!({ "sec": utc_ms / 1000, "nsec": utc_ms % 1000 * 1_000_000 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(picture: &mut Picture, message: &Message) -> Vec<Drawing> {
        picture.on_message(message.topic(), 1500, &message.encode())
    }

    fn channels(drawings: &[Drawing]) -> Vec<&'static str> {
        drawings.iter().map(|it| it.channel).collect()
    }

    fn ned(north_m: f64, east_m: f64) -> v1::Ned {
        v1::Ned { north_m, east_m, down_m: -10.0 }
    }

    fn mission() -> v1::MissionStatus {
        let corners = vec![ned(0.0, 100.0), ned(100.0, 100.0), ned(100.0, 200.0)];
        let area = v1::Area { name: "A".into(), kind: AreaKind::KeepOut.into(), corners, ..Default::default() };
        let goal_state = v1::PlanningState { position: Some(ned(0.0, 500.0)), ..Default::default() };
        let step = v1::PlanStep { from: Some(ned(0.0, 0.0)), goal_state: Some(goal_state), ..Default::default() };
        let plan = v1::Plan { steps: vec![step], ..Default::default() };
        v1::MissionStatus { areas: vec![area], plan: Some(plan), ..Default::default() }
    }

    fn at_origin() -> v1::Introspection {
        let origin = v1::Origin { latitude_deg: 47.4, longitude_deg: 8.5, altitude_amsl_m: None };
        let status = v1::VehicleStatus { origin: Some(origin), ..Default::default() };
        v1::Introspection { status: Some(status), ..Default::default() }
    }

    #[test]
    fn the_map_is_drawn_once_the_origin_is_known_and_again_only_after_a_change() {
        let mut picture = Picture::default();
        assert_eq!(channels(&heard(&mut picture, &mission().into())), [""; 0]);
        let drawn = heard(&mut picture, &at_origin().into());
        assert_eq!(channels(&drawn), ["foxglove/map", "foxglove/scene"]);
        let map: Value = serde_json::from_str(drawn[0].message["geojson"].as_str().unwrap()).unwrap();
        let features = map["features"].as_array().unwrap();
        assert_eq!(features.len(), 2, "{map:#}");
        assert_eq!(features[0]["properties"]["name"], "A");
        let area = features[0]["geometry"]["coordinates"][0].as_array().unwrap();
        assert_eq!((area.len(), &area[0]), (4, &area[3]), "a polygon is closed");
        let end = &features[1]["geometry"]["coordinates"][1];
        assert!((end[0].as_f64().unwrap() - 8.50663).abs() < 1e-4, "500 m east are 0.0066 degrees there: {end}");
        assert_eq!(drawn[1].message["entities"][0]["lines"].as_array().unwrap().len(), 3, "floor, ceiling and plan");
        assert_eq!(channels(&heard(&mut picture, &mission().into())), [""; 0]);
        let way = v1::ResponseWay { points: vec![ned(0.0, 0.0), ned(50.0, 0.0)], ..Default::default() };
        let status = v1::McmStatus { response_way: Some(way), ..Default::default() };
        assert_eq!(channels(&heard(&mut picture, &status.into())), ["foxglove/map", "foxglove/scene"]);
    }

    #[test]
    fn a_decision_is_a_line_of_the_log_with_its_reasons() {
        let rejected = v1::RejectedAlternative { what: "home".into(), why: "out of reach".into() };
        let decision = v1::DecisionRecord {
            topic: "contingency".into(),
            text: "lands at site quay".into(),
            flag: "battery_low".into(),
            response_reason: "12 m".into(),
            rejected: vec![rejected],
            ..Default::default()
        };
        let drawn = heard(&mut Picture::default(), &decision.into());
        let expected = "lands at site quay (12 m); not home: out of reach";
        assert_eq!((&drawn[0].message["message"], &drawn[0].message["level"]), (&json!(expected), &json!(3)));
        assert_eq!(drawn[0].message["timestamp"], json!({ "sec": 1, "nsec": 500_000_000 }));
    }

    #[test]
    fn every_channel_has_a_schema() {
        for name in ["LocationFix", "FrameTransform", "GeoJSON", "Log", "SceneUpdate"] {
            let schema: Value = serde_json::from_str(&schema(&format!("foxglove.{name}"))).unwrap();
            assert_eq!(schema["title"], format!("foxglove.{name}"));
        }
    }
}
