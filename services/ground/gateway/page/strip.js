// The state strip: one cell for each value, in the order in which an operator scans them.

import { attribute, h, list, part, text } from "./dom.js";
import { isSourceStale, lostFor, silence, sourceAge, store } from "./store.js";
import { age, clock, mode, name, number } from "./words.js";

export function mountStrip() {
  const strip = document.getElementById("strip");
  return () => {
    const cells = store.doc ? cellsOf(store.doc) : [];
    list(strip, cells, (it) => it.label, make, fill);
  };
}

function make({ label }) {
  return h(
    "div",
    { class: "cell" },
    h("span", { class: "label" }, label),
    h("span", { class: "value", "data-part": "value" }),
    h("span", { class: "note", "data-part": "note" }),
  );
}

function fill(cell, { value, unit, note, tone }) {
  const place = part(cell, "value");
  text(place, unit && value !== "–" ? `${value}\u202f${unit}` : value);
  text(part(cell, "note"), note ?? "");
  attribute(cell, "data-tone", tone ?? null);
}

function cellsOf(doc) {
  const aircraft = doc.aircraft ?? {};
  const { status, battery, derived, localPosition, landDetected } = aircraft;
  const position = localPosition?.position;
  const heading = localPosition ? ((localPosition.headingRad * 180) / Math.PI + 360) % 360 : null;
  const valid = localPosition?.horizontalValid && localPosition?.verticalValid;
  const preempted = status && status.actualMode !== status.intendedMode;
  const cells = [
    {
      label: "Mode",
      value: mode(status?.actualMode),
      note: status?.failsafe ? "autopilot failsafe" : preempted ? `intended: ${mode(status.intendedMode)}` : skillNote(doc),
      tone: status?.failsafe ? "bad" : preempted ? "warn" : null,
    },
    {
      label: "Motors",
      value: status ? (status.armed ? "armed" : "disarmed") : "–",
      note: landDetected ? (landDetected.landed ? "on the ground" : "in the air") : "",
    },
    {
      label: "Battery",
      value: number(battery ? battery.remaining * 100 : null),
      unit: "%",
      note: battery ? `${number(battery.voltageV, 1)} V  ${number(battery.currentA, 0)} A` : "",
      tone: battery ? beyondThreshold("battery.charge_percent", 100 * battery.remaining) : null,
    },
    { label: "Height", value: number(derived?.heightM, 1), unit: "m", note: `climb ${number(derived?.climbRateMS, 1)} m/s` },
    { label: "Ground speed", value: number(derived?.groundSpeedMS, 1), unit: "m/s", note: `course ${number(courseOf(localPosition))}°, heading ${number(heading)}°` },
    {
      label: "Home",
      value: number(derived?.distanceHomeM),
      unit: "m",
      note: position ? `N ${number(position.northM)}  E ${number(position.eastM)}` : "",
    },
    {
      label: "Position",
      value: localPosition ? `±${number(localPosition.ephM, 1)}` : "–",
      unit: "m",
      note: !localPosition ? "" : valid ? places(aircraft.globalPosition) : "estimate not valid",
      tone: localPosition && !valid ? "bad" : null,
    },
  ];
  const energy = energyCell(doc);
  if (energy) cells.push(energy);
  const wind = doc.wind;
  if (wind) {
    const speed = Math.hypot(wind.northMS ?? 0, wind.eastMS ?? 0);
    const tone = beyondThreshold("wind.speed_m_s", speed);
    cells.push({ label: "Wind", value: number(speed, 1), unit: "m/s", note: `to ${number(direction(wind))}°`, tone });
  }
  cells.push(nearby(doc.traffic, position), links(), failures(status));
  return cells.filter(Boolean);
}

/** Where it moves to over ground, in degrees from north; nothing while it does not move. */
function courseOf(localPosition) {
  const { northMS = 0, eastMS = 0 } = localPosition?.velocity ?? {};
  return Math.hypot(northMS, eastMS) < 0.5 ? null : direction({ northMS, eastMS });
}

/** `59.91234° N  10.75234° E`. */
function places(it) {
  if (!it) return "estimate valid";
  const side = (value, positive, negative) => `${number(Math.abs(value ?? 0), 5)}° ${(value ?? 0) < 0 ? negative : positive}`;
  return `${side(it.latitudeDeg, "N", "S")}  ${side(it.longitudeDeg, "E", "W")}`;
}

/** Time home, and how long the battery lasts; in flight, as far as the vehicle tells. */
function energyCell(doc) {
  const home = doc.alternates?.find((it) => it.role === "ALTERNATE_ROLE_HOME");
  const { energy } = doc;
  if (!home && !energy) return null;
  const homeS = energy?.home?.timeS ?? home?.timeS;
  const turn = energy?.turnHomeS;
  const left = home?.charge == null ? "" : `${number(home.charge * 100)} % left there`;
  const last = energy ? `hover ${clock(energy.enduranceS)}, turn in ${turn == null ? "–" : clock(turn)}` : left;
  return {
    label: "Time home",
    value: homeS == null ? "no way" : clock(homeS),
    note: last,
    tone: homeS == null || home?.whyNot ? "bad" : turn != null && turn <= 0 ? "bad" : turn != null && turn < 60 ? "warn" : null,
  };
}

/** `bad` beyond a threshold of the contingency table, `warn` beyond no more than the last of several, which acts first; else nothing. */
function beyondThreshold(quantity, value) {
  const thresholds = (store.session?.thresholds ?? []).filter((it) => it.quantity === quantity);
  const index = thresholds.findIndex((it) => (it.above ? value > it.value : value < it.value));
  return index < 0 ? null : 0 < index && index === thresholds.length - 1 ? "warn" : "bad";
}

/** Reported traffic: the distance of the nearest aircraft. */
function nearby(traffic, position) {
  if (!traffic?.length || !position) return null;
  const away = ({ position: it = {} }) => Math.hypot(...["northM", "eastM", "downM"].map((axis) => (it[axis] ?? 0) - (position[axis] ?? 0)));
  const nearest = traffic.reduce((a, b) => (away(b) < away(a) ? b : a));
  return {
    label: "Traffic",
    value: number(away(nearest)),
    unit: "m",
    note: `${nearest.id}, ${number(-(nearest.position?.downM ?? 0))} m high${traffic.length > 1 ? `, and ${traffic.length - 1} more` : ""}`,
    tone: "warn",
  };
}

/** Where the wind blows to, in degrees from north. */
function direction({ northMS = 0, eastMS = 0 }) {
  return ((Math.atan2(eastMS, northMS) * 180) / Math.PI + 360) % 360;
}

function skillNote(doc) {
  const running = doc.skill?.running;
  return running ? `${name(running.kind, "SKILL_KIND")} skill` : "no skill";
}

function links() {
  const monitor = sourceAge("introspection");
  const position = store.doc.aircraft?.ages?.localPositionS;
  return {
    label: "Link",
    value: age(lostFor() ?? silence()),
    note: `monitor ${age(monitor)}, position ${age(position)}`,
    tone: isSourceStale("introspection") ? "bad" : null,
  };
}

function failures(status) {
  if (!status?.failures?.length) return null;
  return {
    label: "Autopilot reports",
    value: `${status.failures.length} failure${status.failures.length === 1 ? "" : "s"}`,
    note: status.failures.map((it) => name(it, "FAILURE_FLAG")).join(", "),
    tone: "bad",
  };
}
