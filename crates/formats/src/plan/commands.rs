//! The commands of MAVLink (`MAV_CMD`) that stand in plans, and what becomes of each.
//!
//! What limits a flight, has a place or changes the order of the items is flown, or refused by its name. What only concerns the
//! payload is kept as an action of the place before it.

/// What becomes of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    Waypoint,
    /// Flown to in a curve, which becomes a straight way.
    Spline,
    LoiterForever,
    LoiterTurns,
    LoiterTime,
    LoiterToHeight,
    Return,
    Land,
    VtolLand,
    Takeoff,
    VtolTakeoff,
    PayloadPlace,
    Delay,
    Jump,
    SetHome,
    FenceEnable,
    /// Where a way begins that a return may use. Reached in the order of the plan it does nothing: ArduPilot's `start_command` has an
    /// empty case for 189, and PX4's `Mission` goes on with the next item.
    LandingSequence,
    Gripper,
    /// Kept in the mission, and not flown yet.
    Action,
    /// It does nothing that a mission knows of.
    Mark(&'static str),
    Refused(&'static str),
}

/// A row of the table.
pub(super) type Command = (i64, &'static str, Meaning);

use Meaning::*;

const AWAY: &str = "who or what leads the vehicle is not in the plan";
const SHAPE: &str = "the way it flies has no counterpart";
const MODE: &str = "what the autopilot does then is not in the plan";
const ORDER: &str = "it changes which items are flown";
const LIMIT: &str = "it changes what limits the flight";
const LOCAL: &str = "a place that is not in latitude and longitude";
const FENCE_FILE: &str = "an item of a fence or of rally points, not of a mission: give such a plan as `.plan`";

/// In the order of their numbers.
pub(super) const COMMANDS: &[Command] = &[
    (16, "MAV_CMD_NAV_WAYPOINT", Waypoint),
    (17, "MAV_CMD_NAV_LOITER_UNLIM", LoiterForever),
    (18, "MAV_CMD_NAV_LOITER_TURNS", LoiterTurns),
    (19, "MAV_CMD_NAV_LOITER_TIME", LoiterTime),
    (20, "MAV_CMD_NAV_RETURN_TO_LAUNCH", Return),
    (21, "MAV_CMD_NAV_LAND", Land),
    (22, "MAV_CMD_NAV_TAKEOFF", Takeoff),
    (23, "MAV_CMD_NAV_LAND_LOCAL", Refused(LOCAL)),
    (24, "MAV_CMD_NAV_TAKEOFF_LOCAL", Refused(LOCAL)),
    (25, "MAV_CMD_NAV_FOLLOW", Refused(AWAY)),
    (30, "MAV_CMD_NAV_CONTINUE_AND_CHANGE_ALT", Refused(SHAPE)),
    (31, "MAV_CMD_NAV_LOITER_TO_ALT", LoiterToHeight),
    (32, "MAV_CMD_DO_FOLLOW", Refused(AWAY)),
    (33, "MAV_CMD_DO_FOLLOW_REPOSITION", Refused(AWAY)),
    (34, "MAV_CMD_DO_ORBIT", Refused(SHAPE)),
    (35, "MAV_CMD_DO_FIGURE_EIGHT", Refused(SHAPE)),
    (36, "MAV_CMD_NAV_ARC_WAYPOINT", Refused(SHAPE)),
    (80, "MAV_CMD_NAV_ROI", Action),
    (81, "MAV_CMD_NAV_PATHPLANNING", Refused(AWAY)),
    (82, "MAV_CMD_NAV_SPLINE_WAYPOINT", Spline),
    (83, "MAV_CMD_NAV_ALTITUDE_WAIT", Refused(SHAPE)),
    (84, "MAV_CMD_NAV_VTOL_TAKEOFF", VtolTakeoff),
    (85, "MAV_CMD_NAV_VTOL_LAND", VtolLand),
    (92, "MAV_CMD_NAV_GUIDED_ENABLE", Refused(AWAY)),
    (93, "MAV_CMD_NAV_DELAY", Delay),
    (94, "MAV_CMD_NAV_PAYLOAD_PLACE", PayloadPlace),
    (95, "MAV_CMD_NAV_LAST", Mark("a mark that does nothing: left out")),
    (112, "MAV_CMD_CONDITION_DELAY", Action),
    (113, "MAV_CMD_CONDITION_CHANGE_ALT", Refused(SHAPE)),
    (114, "MAV_CMD_CONDITION_DISTANCE", Action),
    (115, "MAV_CMD_CONDITION_YAW", Action),
    (159, "MAV_CMD_CONDITION_LAST", Mark("a mark that does nothing: left out")),
    (176, "MAV_CMD_DO_SET_MODE", Refused(MODE)),
    (177, "MAV_CMD_DO_JUMP", Jump),
    (178, "MAV_CMD_DO_CHANGE_SPEED", Action),
    (179, "MAV_CMD_DO_SET_HOME", SetHome),
    (180, "MAV_CMD_DO_SET_PARAMETER", Refused(LIMIT)),
    (181, "MAV_CMD_DO_SET_RELAY", Action),
    (182, "MAV_CMD_DO_REPEAT_RELAY", Action),
    (183, "MAV_CMD_DO_SET_SERVO", Action),
    (184, "MAV_CMD_DO_REPEAT_SERVO", Action),
    (185, "MAV_CMD_DO_FLIGHTTERMINATION", Refused(MODE)),
    (186, "MAV_CMD_DO_CHANGE_ALTITUDE", Refused(SHAPE)),
    (187, "MAV_CMD_DO_SET_ACTUATOR", Action),
    (188, "MAV_CMD_DO_RETURN_PATH_START", LandingSequence),
    (189, "MAV_CMD_DO_LAND_START", LandingSequence),
    (190, "MAV_CMD_DO_RALLY_LAND", Refused(ORDER)),
    (191, "MAV_CMD_DO_GO_AROUND", Refused(ORDER)),
    (192, "MAV_CMD_DO_REPOSITION", Refused(MODE)),
    (193, "MAV_CMD_DO_PAUSE_CONTINUE", Refused(ORDER)),
    (194, "MAV_CMD_DO_SET_REVERSE", Refused(SHAPE)),
    (195, "MAV_CMD_DO_SET_ROI_LOCATION", Action),
    (196, "MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET", Action),
    (197, "MAV_CMD_DO_SET_ROI_NONE", Action),
    (198, "MAV_CMD_DO_SET_ROI_SYSID", Action),
    (200, "MAV_CMD_DO_CONTROL_VIDEO", Action),
    (201, "MAV_CMD_DO_SET_ROI", Action),
    (202, "MAV_CMD_DO_DIGICAM_CONFIGURE", Action),
    (203, "MAV_CMD_DO_DIGICAM_CONTROL", Action),
    (204, "MAV_CMD_DO_MOUNT_CONFIGURE", Action),
    (205, "MAV_CMD_DO_MOUNT_CONTROL", Action),
    (206, "MAV_CMD_DO_SET_CAM_TRIGG_DIST", Action),
    (207, "MAV_CMD_DO_FENCE_ENABLE", FenceEnable),
    (208, "MAV_CMD_DO_PARACHUTE", Refused(MODE)),
    (209, "MAV_CMD_DO_MOTOR_TEST", Refused(MODE)),
    (210, "MAV_CMD_DO_INVERTED_FLIGHT", Refused(SHAPE)),
    (211, "MAV_CMD_DO_GRIPPER", Gripper),
    (212, "MAV_CMD_DO_AUTOTUNE_ENABLE", Refused(MODE)),
    (213, "MAV_CMD_NAV_SET_YAW_SPEED", Refused(SHAPE)),
    (214, "MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL", Action),
    (215, "MAV_CMD_DO_SET_RESUME_REPEAT_DIST", Mark("how a mission is resumed is the planner's business: left out")),
    (216, "MAV_CMD_DO_SPRAYER", Action),
    (217, "MAV_CMD_DO_SEND_SCRIPT_MESSAGE", Action),
    (218, "MAV_CMD_DO_AUX_FUNCTION", Refused(MODE)),
    (220, "MAV_CMD_DO_MOUNT_CONTROL_QUAT", Action),
    (221, "MAV_CMD_DO_GUIDED_MASTER", Refused(AWAY)),
    (222, "MAV_CMD_DO_GUIDED_LIMITS", Refused(LIMIT)),
    (223, "MAV_CMD_DO_ENGINE_CONTROL", Refused(MODE)),
    (224, "MAV_CMD_DO_SET_MISSION_CURRENT", Refused(ORDER)),
    (252, "MAV_CMD_OVERRIDE_GOTO", Refused(ORDER)),
    (260, "MAV_CMD_OBLIQUE_SURVEY", Action),
    (300, "MAV_CMD_MISSION_START", Refused(ORDER)),
    (400, "MAV_CMD_COMPONENT_ARM_DISARM", Refused(MODE)),
    (530, "MAV_CMD_SET_CAMERA_MODE", Action),
    (531, "MAV_CMD_SET_CAMERA_ZOOM", Action),
    (532, "MAV_CMD_SET_CAMERA_FOCUS", Action),
    (534, "MAV_CMD_SET_CAMERA_SOURCE", Action),
    (600, "MAV_CMD_JUMP_TAG", Mark("a mark for jumps by tag, which are refused: left out")),
    (601, "MAV_CMD_DO_JUMP_TAG", Refused(ORDER)),
    (1000, "MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW", Action),
    (1001, "MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE", Action),
    (2000, "MAV_CMD_IMAGE_START_CAPTURE", Action),
    (2001, "MAV_CMD_IMAGE_STOP_CAPTURE", Action),
    (2003, "MAV_CMD_DO_TRIGGER_CONTROL", Action),
    (2004, "MAV_CMD_CAMERA_TRACK_POINT", Action),
    (2005, "MAV_CMD_CAMERA_TRACK_RECTANGLE", Action),
    (2010, "MAV_CMD_CAMERA_STOP_TRACKING", Action),
    (2500, "MAV_CMD_VIDEO_START_CAPTURE", Action),
    (2501, "MAV_CMD_VIDEO_STOP_CAPTURE", Action),
    (3000, "MAV_CMD_DO_VTOL_TRANSITION", Mark("the vehicle is a multicopter: it changes to no other way of flying")),
    (3001, "MAV_CMD_ARM_AUTHORIZATION_REQUEST", Refused(MODE)),
    (4000, "MAV_CMD_SET_GUIDED_SUBMODE_STANDARD", Refused(MODE)),
    (4501, "MAV_CMD_CONDITION_GATE", Refused(SHAPE)),
    (5000, "MAV_CMD_NAV_FENCE_RETURN_POINT", Refused(FENCE_FILE)),
    (5001, "MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION", Refused(FENCE_FILE)),
    (5002, "MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION", Refused(FENCE_FILE)),
    (5003, "MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION", Refused(FENCE_FILE)),
    (5004, "MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION", Refused(FENCE_FILE)),
    (5100, "MAV_CMD_NAV_RALLY_POINT", Refused(FENCE_FILE)),
    (30001, "MAV_CMD_PAYLOAD_PREPARE_DEPLOY", Refused(SHAPE)),
    (30002, "MAV_CMD_PAYLOAD_CONTROL_DEPLOY", Refused(SHAPE)),
    (42600, "MAV_CMD_DO_WINCH", Action),
];

pub(super) const WAYPOINT: i64 = 16;
pub(super) const LOITER_TO_HEIGHT: i64 = 31;
pub(super) const LAND: i64 = 21;
pub(super) const TAKEOFF: i64 = 22;
pub(super) const VTOL_LAND: i64 = 85;
pub(super) const DELAY: i64 = 93;
pub(super) const CHANGE_SPEED: i64 = 178;
pub(super) const LAND_START: i64 = 189;
pub(super) const CAMERA_DISTANCE: i64 = 206;
pub(super) const GRIPPER: i64 = 211;
pub(super) const IMAGE_STOP: i64 = 2001;
pub(super) const VIDEO_STOP: i64 = 2501;

/// The row of a command.
pub(super) fn find(number: i64) -> Option<&'static Command> {
    COMMANDS.iter().find(|it| it.0 == number)
}

/// Whether an unknown command of this number may fly the vehicle, or hold it: MAVLink numbers such commands below 96 and from 112 to 159.
pub(super) fn may_fly(number: i64) -> bool {
    number <= 95 || (112..=159).contains(&number)
}
