//! `kittiwake plan`: what the planner would fly, before anything flies.
//!
//! The planner itself is asked, as the mission manager asks it for an operator whether a mission can be flown: both get the same answer.

use std::path::Path;
use std::str::FromStr;
use std::time::{SystemTime, UNIX_EPOCH};

use domain::file::{Mistake, Mistakes, Source};
use domain::time::{Now, Time};
use kittiwake_proto::json::to_json;
use kittiwake_proto::v1;
use kittiwake_proto::v1::mission_request::Request as Ask;
use planner::Planner;

use crate::check_inputs::{self, Inputs};
use crate::cli::PlanArgs;
use crate::outcome::Outcome;
use crate::output;
use crate::settings::Settings;

mod html;
pub mod picture;
mod text;

/// A wind on the command line: `8`, against every leg, or `8,270`, from the west.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindArg {
    speed_m_s: f64,
    from_deg: Option<f64>,
}

impl FromStr for WindArg {
    type Err = String;
    fn from_str(text: &str) -> Result<WindArg, String> {
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|it| it.is_finite());
        let (speed, from) = text.split_once(',').map_or((text, None), |(speed, from)| (speed, Some(from)));
        let speed_m_s = number(speed).filter(|it| (0.0..=60.0).contains(it));
        let from_deg = from.map(|it| number(it).filter(|it| (0.0..=360.0).contains(it)));
        match (speed_m_s, from_deg) {
            (Some(speed_m_s), None) => Ok(WindArg { speed_m_s, from_deg: None }),
            (Some(speed_m_s), Some(Some(from_deg))) => Ok(WindArg { speed_m_s, from_deg: Some(from_deg) }),
            _ => Err(format!(
                "found wind `{text}`, expected metres per second from 0 to 60, and after a comma the direction it comes from, \
                 0 to 360 degrees, such as `8,270`"
            )),
        }
    }
}

/// Prints the plan, and writes it as a page if one is wanted.
pub fn plan(args: &PlanArgs) -> Outcome {
    let settings = Settings { mission: Some(args.mission.clone()), ..Settings::of_file(&args.config) };
    let inputs = match check_inputs::read_or_tell(&settings) {
        Ok(inputs) => inputs,
        Err(outcome) => return outcome,
    };
    let reply = match forecast(&inputs, args.wind) {
        Ok(reply) => reply,
        Err(mistakes) => return check_inputs::tell(&mistakes),
    };
    let notes: Vec<String> = crate::airspace::lines_of(&inputs.mission).into_iter().chain(inputs.notes()).collect();
    if let Some(path) = &args.html
        && let Err(error) = regular_file::write(path, html::page(&reply, args.wind, &notes))
    {
        output::error_line(format_args!("{}: cannot be written: {error}", path.display()));
        return Outcome::BadInput;
    }
    if args.json {
        output::line(format_args!("{:#}", to_json(&reply)));
    } else {
        output::line(text::plan(&reply, args.wind, &notes).trim_end());
    }
    if reply.accepted { Outcome::Success } else { Outcome::NotFlyable }
}

/// A forecast with the configured wind, in words: legs, energy, areas and alternates.
pub fn in_words(reply: &v1::MissionReply) -> String {
    text::plan(reply, None, &[])
}

/// `text` as it stands in a page.
pub fn escape(text: &str) -> String {
    html::escape(text)
}

/// What the planner answers about the mission of `inputs`, for a vehicle with a full battery at the take-off point.
///
/// # Errors
/// If the mission's file cannot be read any more, or the planner would not read it.
pub fn forecast(inputs: &Inputs, wind: Option<WindArg>) -> Result<v1::MissionReply, Mistakes> {
    let config = &inputs.config;
    let text = Source::read(&config.mission)?.text;
    let wind = wind.map(|WindArg { speed_m_s, from_deg }| v1::ForecastWind { speed_m_s, from_deg });
    let state = v1::PlanningState { position: Some(v1::Ned::default()), charge: Some(1.0), ..Default::default() };
    let request = v1::MissionRequest {
        state: Some(state),
        request: Some(Ask::Validate(v1::MissionText { text, wind })),
        ..Default::default()
    };
    let mut planner =
        Planner::new(&config.planner, &config.aircraft(), config.speed.pace()).with_skills(inputs.skills.clone());
    let reply = planner.try_out(&inputs.mission, request, now());
    // On board the mission manager fills it in.
    let status = Some((&inputs.mission).into());
    if reply.mistakes.is_empty() { Ok(v1::MissionReply { status, ..reply }) } else { Err(unread(&config.mission)) }
}

/// The file was replaced since it was checked.
fn unread(path: &Path) -> Mistakes {
    let message = "has changed while it was read".to_owned();
    Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help: "try again".into() }])
}

/// Mission time begins; time windows and deadlines are in UTC.
#[expect(clippy::disallowed_methods, reason = "areas and deadlines apply by UTC")]
pub fn now() -> Now {
    let utc_ms = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |it| it.as_millis() as i64);
    Now { time: Time::ZERO, utc_ms }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_names_the_mission_and_says_how_close_together_the_lines_of_a_survey_are() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
        let mission = Some(folder.join("missions/field.toml"));
        let settings = Settings { mission, ..Settings::of_file(&folder.join("kittiwake.toml")) };
        let text = in_words(&forecast(&check_inputs::read(&settings).unwrap(), None).unwrap());
        assert!(text.starts_with("mission `field`, ") && text.contains("\n  survey: lines 30 m apart\n"), "{text}");
    }

    #[test]
    fn a_wind_has_a_speed_and_maybe_a_direction() {
        #[track_caller]
        fn check(text: &str, expected: Option<(f64, Option<f64>)>) {
            let found = text.parse::<WindArg>().ok().map(|it| (it.speed_m_s, it.from_deg));
            assert_eq!(found, expected, "{text}");
        }
        check("8", Some((8.0, None)));
        check("8.5, 270", Some((8.5, Some(270.0))));
        check("0,0", Some((0.0, Some(0.0))));
        for text in ["", "west", "-1", "61", "nan", "8,", "8,361", "8,270,1", "inf"] {
            check(text, None);
        }
    }
}
