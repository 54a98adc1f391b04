// The mission as the text of a mission file, made of the mission's status.
//
// Settled objectives are left out: an upload starts where the vehicle is.

const SITES = { SITE_KIND_LANDING: "landing", SITE_KIND_DITCH: "ditch" };
/** What is below an area that only bars landings. */
const BELOW = { GROUND_KIND_WATER: "water", GROUND_KIND_PEOPLE: "people" };
const KINDS = { AREA_KIND_PERMISSION: "permission", AREA_KIND_KEEP_OUT: "keep-out" };

/** A text as a basic string of TOML: every string of JSON is one. */
const quoted = (it) => JSON.stringify(it);

/** A number that TOML reads as a float, as exact as it comes. */
function exact(value = 0) {
  const shown = String(value);
  return /[.e]/.test(shown) ? shown : `${shown}.0`;
}

/** The same, to a centimetre. */
const float = (value = 0) => exact(Math.round(value * 100) / 100);

const utc = (ms) => new Date(Number(ms)).toISOString().replace(".000Z", "Z");

/** `mission`: the mission's status. */
export function missionText(mission) {
  const waiting = mission.objectives.filter((it) => it.state === "OBJECTIVE_STATE_WAITING");
  const settled = mission.objectives.filter((it) => it.state !== "OBJECTIVE_STATE_WAITING");
  const lines = ["# Positions are metres from the take-off point; heights are above it."];
  if (settled.length) lines.push(`# Settled and left out: ${settled.map((it) => it.name).join(", ")}.`);
  // What the control tower has closed stays by itself: no data set.
  const feeds = (mission.feeds ?? []).filter((it) => it.name !== "control tower");
  lines.push(`name = ${quoted(mission.mission)}`, ...(mission.freeOrder ? ['order = "free"'] : []), "", ...origin(mission.origin), ...waiting.map(among(waiting)).flatMap(objective), ...feeds.flatMap(feed), ...mission.areas.map(fromFeeds(feeds)).flatMap(area), ...(mission.sites ?? []).flatMap(site));
  return `${lines.join("\n").trimEnd()}\n`;
}

/** Without it the mission would be flown from wherever the vehicle stands. */
function origin(it) {
  if (!it) return [];
  const { latitudeDeg, longitudeDeg, altitudeAmslM } = it;
  const altitude = altitudeAmslM == null ? [] : [`altitude_m = ${exact(altitudeAmslM)}`];
  return ["[origin]", `latitude_deg = ${exact(latitudeDeg)}`, `longitude_deg = ${exact(longitudeDeg)}`, ...altitude, ""];
}

/** An objective comes after those only that are still to be reached. */
function among(waiting) {
  const names = new Set(waiting.map((it) => it.name));
  return (it) => ({ ...it, after: (it.after ?? []).filter((name) => names.has(name)) });
}

function objective({ name, position, flying, survey, worth, after, reachWithinS, reachByUtcMs, dwellS, drop, landOnTarget, actions = [], tasks = [], along = [] }) {
  const place = survey ? [surveyed(survey)] : [`north_m = ${float(position?.northM)}`, `east_m = ${float(position?.eastM)}`];
  return [
    "[[objective]]",
    `name = ${quoted(name)}`,
    ...place,
    `height_m = ${float(0 - (position?.downM ?? 0))}`,
    `flying = ${Boolean(flying)}`,
    worth == null ? null : `optional = true\nworth = ${float(worth)}`,
    after.length ? `after = [${after.map(quoted).join(", ")}]` : null,
    reachWithinS == null ? null : `reach_within_s = ${float(reachWithinS)}`,
    reachByUtcMs == null ? null : `reach_by_utc = ${quoted(utc(reachByUtcMs))}`,
    dwellS ? `dwell_s = ${float(dwellS)}` : null,
    drop ? "drop = true" : null,
    landOnTarget ? "land_on_target = true" : null,
    actions.length ? `actions = [${actions.map(quoted).join(", ")}]` : null,
    tasks.length ? `do = [${tasks.map(task).join(", ")}]` : null,
    along.length ? `along = [${along.map(task).join(", ")}]` : null,
    "",
  ].filter((it) => it != null);
}

const task = ({ skill, inputs = [] }) => `{ ${[`skill = ${quoted(skill)}`, ...inputs.map(({ name, value }) => `${name} = ${exact(value)}`)].join(", ")} }`;

/** The whole survey: an upload begins it again. */
function surveyed({ corners, spacingM, pictureDistanceM, headingDeg }) {
  const pictures = pictureDistanceM == null ? "" : `, picture_distance_m = ${float(pictureDistanceM)}`;
  const heading = headingDeg == null ? "" : `, heading_deg = ${float(headingDeg)}`;
  return `survey = { corners_m = ${ring(corners)}, spacing_m = ${float(spacingM)}${pictures}${heading} }`;
}

const ring = (corners) => `[${corners.map(corner).join(", ")}]`;
const corner = ({ northM, eastM }) => `[${float(northM)}, ${float(eastM)}]`;

/** The edition of a data set. */
function feed({ name, provider, issuedUtcMs, validFromUtcMs, validUntilUtcMs }) {
  const moment = (key, ms) => (ms == null ? null : `${key} = ${quoted(utc(ms))}`);
  return ["[[feed]]", `name = ${quoted(name)}`, provider ? `provider = ${quoted(provider)}` : null, moment("issued_utc", issuedUtcMs), moment("valid_from_utc", validFromUtcMs), moment("valid_until_utc", validUntilUtcMs), ""].filter((it) => it != null);
}

/** An area with the name of the feed that it came from. */
function fromFeeds(feeds = []) {
  const names = new Map(feeds.flatMap((it) => (it.areas ?? []).map((index) => [index, it.name])));
  return (it, index) => ({ ...it, feed: names.get(index) });
}

function area({ name, feed, kind, corners, holes = [], floorM, ceilingM, fromUtcMs, untilUtcMs, hoursUtc = [], ground }) {
  const below = BELOW[ground];
  return [
    "[[area]]",
    `name = ${quoted(name)}`,
    feed == null ? null : `feed = ${quoted(feed)}`,
    `kind = ${quoted(below ? "no-landing" : KINDS[kind])}`,
    below ? `ground = ${quoted(below)}` : null,
    `corners_m = ${ring(corners)}`,
    holes.length ? `holes_m = [${holes.map((it) => ring(it.corners)).join(", ")}]` : null,
    floorM == null || below ? null : `floor_m = ${float(floorM)}`,
    ceilingM == null || below ? null : `ceiling_m = ${float(ceilingM)}`,
    fromUtcMs == null ? null : `from_utc = ${quoted(utc(fromUtcMs))}`,
    untilUtcMs == null ? null : `until_utc = ${quoted(utc(untilUtcMs))}`,
    hoursUtc.length ? `hours_utc = [${hoursUtc.map(quoted).join(", ")}]` : null,
    "",
  ].filter((it) => it != null);
}

function site({ name, kind, position }) {
  return [
    "[[site]]",
    `name = ${quoted(name)}`,
    `kind = ${quoted(SITES[kind])}`,
    `north_m = ${float(position?.northM)}`,
    `east_m = ${float(position?.eastM)}`,
    `height_m = ${float(0 - (position?.downM ?? 0))}`,
    "",
  ];
}
