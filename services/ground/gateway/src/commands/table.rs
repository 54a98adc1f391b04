//! Which routes order something, and who may.

use super::{
    abort, acknowledge, decide_permission, decide_plan, hand_over, inject_fault, inject_flag, insert, land_at,
    list_faults, pause, release, remove, replan, resume, return_home, skip, start, take, upload, validate,
};
use crate::access::Role;
use crate::routes::{Access, Method, READERS, Route, Routes};

const HELM: Access = Access::Helm(&[]);
const HELM_OR_SAFETY: Access = Access::Helm(&[Role::Safety]);
const OPERATORS: Access = Access::OneOf(&[Role::Operator]);
const TOWER: Access = Access::Keyed(&[Role::Tower]);
const INJECTORS: Access = Access::Keyed(&[Role::Operator, Role::Safety]);

macro_rules! route {
    ($method:ident $path:literal $access:expr, $summary:literal, $body:literal => $answer:literal) => {
        Route {
            method: Method::$method,
            path: concat!("/api/v1/vehicles/{id}/", $path),
            access: $access,
            summary: $summary,
            body: $body,
            answer: $answer,
        }
    };
}

/// Adds every route that orders something.
pub(crate) fn add_to(routes: Routes, simulation: bool) -> Routes {
    let routes = routes
        .add(route!(Post "command/take" OPERATORS, "Take command of the vehicle", "" => "Command"), take)
        .add(route!(Post "command/release" OPERATORS, "Give command back", "" => "Command"), release)
        .add(
            route!(Post "command/hand-over" OPERATORS, "Let somebody else take command", "HandOver" => "Command"),
            hand_over,
        )
        .add(route!(Post "start" HELM, "Begin a mission that waits for it", "" => "Done"), start)
        .add(route!(Post "pause" HELM_OR_SAFETY, "Hold until resumed", "" => "Done"), pause)
        .add(route!(Post "resume" HELM, "Go on after a pause", "" => "Done"), resume)
        .add(route!(Post "abort" HELM_OR_SAFETY, "Land here and end the mission", "" => "Done"), abort)
        .add(route!(Post "return" HELM_OR_SAFETY, "Fly home, land and end the mission", "" => "Done"), return_home)
        .add(
            route!(Post "land-at" HELM_OR_SAFETY, "Land at a place and end the mission",
                "kittiwake.v1.LandAt" => "Done"),
            land_at,
        )
        .add(route!(Post "replan" HELM, "Give the present step up and plan anew", "" => "Done"), replan)
        .add(
            route!(Post "contingencies/{flag}/acknowledge" HELM_OR_SAFETY, "Say that a contingency has been seen",
                "" => "Done"),
            acknowledge,
        )
        .add(
            route!(Post "plan/decision" HELM, "Approve or refuse a plan that waits for it",
                "kittiwake.v1.DecidePlan" => "Done"),
            decide_plan,
        )
        .add(
            route!(Post "permissions/{area}/decision" TOWER, "Grant, deny or revoke a permission by hand",
                "kittiwake.v1.DecideRequest" => "Done"),
            decide_permission,
        )
        .add(
            route!(Post "mission/validate" OPERATORS, "What a mission would take, without flying it",
                "kittiwake.v1.MissionText" => "kittiwake.v1.MissionReply"),
            validate,
        )
        .add(
            route!(Put "mission" HELM, "Put another mission in the place of the present one",
                "kittiwake.v1.MissionText" => "kittiwake.v1.MissionReply"),
            upload,
        )
        .add(
            route!(Post "mission/objectives" HELM, "Insert an objective",
                "kittiwake.v1.InsertObjective" => "kittiwake.v1.MissionReply"),
            insert,
        )
        .add(
            route!(Delete "mission/objectives/{name}" HELM, "Take an objective out",
                "" => "kittiwake.v1.MissionReply"),
            remove,
        )
        .add(
            route!(Post "mission/objectives/{name}/skip" HELM, "Give an objective up",
                "" => "kittiwake.v1.MissionReply"),
            skip,
        );
    if !simulation {
        return routes;
    }
    routes
        .add(
            route!(Post "simulation/flags" INJECTORS, "Raise or lower a flag by hand",
                "kittiwake.v1.FlagEvent" => "Done"),
            inject_flag,
        )
        .add(route!(Get "simulation/faults" READERS, "The faults that can be injected", "" => "FaultList"), list_faults)
        .add(
            route!(Post "simulation/faults" INJECTORS, "Inject a fault into the simulator",
                "kittiwake.v1.FaultRequest" => "Done"),
            inject_fault,
        )
}
