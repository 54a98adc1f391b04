//! The routes of orders: who may give them, what they take and what they answer.

use kittiwake_proto::v1;
use prost::Name;

use super::{
    abort, accept_loss, acknowledge, adopt_airspace, decide_permission, decide_plan, hand_over, inject_fault,
    inject_flag, insert, inspected, land_at, list_faults, pause, read_mission, release, remove, replan, report_site,
    resume, return_home, skip, start, take, upload, validate, validate_airspace,
};
use crate::access::Role;
use crate::http::routes::{Access, Method, READERS, Reply, Route, Routes};

const IN_COMMAND: Access = Access::InCommand(&[]);
const IN_COMMAND_OR_SAFETY: Access = Access::InCommand(&[Role::Safety]);
const OPERATORS: Access = Access::OneOf(&[Role::Operator]);
const TOWER: Access = Access::Keyed(&[Role::Tower]);
const INJECTORS: Access = Access::Keyed(&[Role::Operator, Role::Safety]);

const AUTHORITY: Reply = Reply::Document(v1::CommandAuthority::NAME);
const DONE: Reply = Reply::Document(v1::OrderDone::NAME);
const MISSION_REPLY: Reply = Reply::Stamped(v1::MissionReply::NAME);

macro_rules! route {
    ($method:ident $path:literal $access:expr, $summary:literal, $body:expr => $reply:expr) => {
        Route {
            method: Method::$method,
            path: concat!("/api/v1/vehicles/{id}/", $path),
            access: $access,
            summary: $summary,
            body: $body,
            body_is_optional: false,
            reply: $reply,
        }
    };
}

/// An order that is mostly given without a body.
fn optional_body(route: Route) -> Route {
    Route { body_is_optional: true, ..route }
}

/// Adds the routes of all orders.
pub(crate) fn add_to(routes: Routes, simulation: bool) -> Routes {
    let mission_text = Some(v1::MissionText::NAME);
    let routes = routes
        .add(route!(Post "command/take" OPERATORS, "Take command of the vehicle", None => AUTHORITY), take)
        .add(route!(Post "command/release" OPERATORS, "Release command", None => AUTHORITY), release)
        .add(
            route!(Post "command/hand-over" OPERATORS, "Let another operator take command",
                Some(v1::HandOver::NAME) => AUTHORITY),
            hand_over,
        )
        .add(route!(Post "start" IN_COMMAND, "Start a mission that waits for it", None => DONE), start)
        .add(optional_body(route!(Post "pause" IN_COMMAND_OR_SAFETY, "Hold until resumed", Some(v1::PauseMission::NAME) => DONE)), pause)
        .add(route!(Post "resume" IN_COMMAND, "Go on after a pause", None => DONE), resume)
        .add(optional_body(route!(Post "abort" IN_COMMAND_OR_SAFETY, "Land here and end the mission", Some(v1::AbortMission::NAME) => DONE)), abort)
        .add(
            optional_body(route!(Post "return" IN_COMMAND_OR_SAFETY, "Fly home, land and end the mission", Some(v1::ReturnHome::NAME) => DONE)),
            return_home,
        )
        .add(
            route!(Post "land-at" IN_COMMAND_OR_SAFETY, "Land at a place and end the mission",
                Some(v1::LandAt::NAME) => DONE),
            land_at,
        )
        .add(route!(Post "replan" IN_COMMAND, "Give up the present step and replan", None => DONE), replan)
        .add(route!(Post "inspected" IN_COMMAND, "The vehicle was inspected after a crash and may fly", None => DONE), inspected)
        .add(
            route!(Post "contingencies/{flag}/acknowledge" IN_COMMAND_OR_SAFETY, "Acknowledge a contingency",
                None => DONE),
            acknowledge,
        )
        .add(
            route!(Post "plan/decision" IN_COMMAND, "Approve or reject a plan that waits for approval",
                Some(v1::DecidePlan::NAME) => DONE),
            decide_plan,
        )
        .add(
            route!(Post "permissions/{area}/decision" TOWER, "Grant, deny or revoke a permission by hand",
                Some(v1::DecideRequest::NAME) => DONE),
            decide_permission,
        )
        .add(
            route!(Post "permissions/accept-loss" TOWER,
                "Let the control tower grant again although it has lost earlier decisions", None => DONE),
            accept_loss,
        )
        .add(
            route!(Post "sites/{site}/report" TOWER, "What the party at a site says of its readiness; it holds for every vehicle",
                Some(v1::SiteReport::NAME) => DONE),
            report_site,
        )
        .add(
            route!(Get "mission" READERS, "The present mission, from the mission manager",
                None => Reply::Stamped(v1::MissionStatus::NAME)),
            read_mission,
        )
        .add(
            route!(Post "mission/validate" OPERATORS, "What a mission would need, without flying it",
                mission_text => MISSION_REPLY),
            validate,
        )
        .add(
            route!(Put "mission" IN_COMMAND,
                "Replace the present mission; the areas that the control tower has closed or a data set has set stay",
                mission_text => MISSION_REPLY),
            upload,
        )
        .add(
            route!(Post "mission/airspace/validate" OPERATORS,
                "What the present mission would need with the areas of another mission file that came from feeds",
                mission_text => MISSION_REPLY),
            validate_airspace,
        )
        .add(
            route!(Put "mission/airspace" IN_COMMAND,
                "Replace the areas of the present mission that came from feeds by those of another mission file",
                mission_text => MISSION_REPLY),
            adopt_airspace,
        )
        .add(
            route!(Post "mission/objectives" IN_COMMAND, "Insert an objective",
                Some(v1::InsertObjective::NAME) => MISSION_REPLY),
            insert,
        )
        .add(
            route!(Delete "mission/objectives/{name}" IN_COMMAND, "Remove an objective", None => MISSION_REPLY),
            remove,
        )
        .add(
            route!(Post "mission/objectives/{name}/skip" IN_COMMAND, "Skip an objective", None => MISSION_REPLY),
            skip,
        );
    if !simulation {
        return routes;
    }
    routes
        .add(
            route!(Post "simulation/flags" INJECTORS, "Raise or clear a flag by hand",
                Some(v1::FlagEvent::NAME) => DONE),
            inject_flag,
        )
        .add(
            route!(Get "simulation/faults" READERS, "The faults that can be injected",
                None => Reply::Document(v1::FaultList::NAME)),
            list_faults,
        )
        .add(
            route!(Post "simulation/faults" INJECTORS, "Inject a fault into the simulator",
                Some(v1::FaultRequest::NAME) => DONE),
            inject_fault,
        )
}
