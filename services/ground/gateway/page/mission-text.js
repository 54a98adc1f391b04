// The mission as the text of a mission file, made of the planner's status.
//
// Settled objectives are left out: an upload starts where the vehicle is.

const KINDS = { AREA_KIND_PERMISSION: "permission", AREA_KIND_KEEP_OUT: "keep-out" };

/** A text as a basic string of TOML: every string of JSON is one. */
const quoted = (it) => JSON.stringify(it);

/** A number that TOML reads as a float, to a centimetre. */
function float(value = 0) {
  const shown = String(Math.round(value * 100) / 100);
  return /[.e]/.test(shown) ? shown : `${shown}.0`;
}

const utc = (ms) => new Date(Number(ms)).toISOString().replace(".000Z", "Z");

/** `mission`: the planner's status. */
export function missionText(mission) {
  const waiting = mission.objectives.filter((it) => it.state === "OBJECTIVE_STATE_WAITING");
  const settled = mission.objectives.filter((it) => it.state !== "OBJECTIVE_STATE_WAITING");
  const lines = ["# Positions are metres from the take-off point; heights are above it."];
  if (settled.length) lines.push(`# Settled and left out: ${settled.map((it) => it.name).join(", ")}.`);
  lines.push(`name = ${quoted(mission.mission)}`, "", ...waiting.flatMap(objective), ...mission.areas.flatMap(area));
  return `${lines.join("\n").trimEnd()}\n`;
}

function objective({ name, position, flying }) {
  return [
    "[[objective]]",
    `name = ${quoted(name)}`,
    `north_m = ${float(position?.northM)}`,
    `east_m = ${float(position?.eastM)}`,
    `height_m = ${float(0 - (position?.downM ?? 0))}`,
    `flying = ${Boolean(flying)}`,
    "",
  ];
}

function area({ name, kind, corners, floorM, ceilingM, fromUtcMs, untilUtcMs }) {
  const corner = ({ northM, eastM }) => `[${float(northM)}, ${float(eastM)}]`;
  return [
    "[[area]]",
    `name = ${quoted(name)}`,
    `kind = ${quoted(KINDS[kind])}`,
    `corners_m = [${corners.map(corner).join(", ")}]`,
    floorM == null ? null : `floor_m = ${float(floorM)}`,
    ceilingM == null ? null : `ceiling_m = ${float(ceilingM)}`,
    fromUtcMs == null ? null : `from_utc = ${quoted(utc(fromUtcMs))}`,
    untilUtcMs == null ? null : `until_utc = ${quoted(utc(untilUtcMs))}`,
    "",
  ].filter((it) => it != null);
}
