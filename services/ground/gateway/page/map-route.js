// Where the vehicle has flown, will fly and would fly, and the sites of its objectives.

import { store } from "./store.js";
import { place, toScreen, vehicle } from "./map-view.js";
import { label, line } from "./map-pen.js";
import { responseWords } from "./response.js";
import { clock } from "./words.js";

const goal = (step) => place(step.goalState?.position);

export function route(pen) {
  const { context, colour } = pen;
  context.lineJoin = "round";
  if (store.trail.length > 1) {
    line(context, store.trail.map((it) => toScreen(it.north, it.east)));
    context.strokeStyle = colour("done");
    context.lineWidth = 3;
    context.stroke();
  }
  const here = vehicle()?.position;
  if (!here || store.doc.report) return;
  noReturn(pen, here);
  const response = store.doc.contingencies;
  ahead(pen, place(here), Boolean(response?.acting));
  if (response?.way) answer(pen, place(here), response.way);
  if (store.doc.plan?.current?.inTransition) {
    const [x, y] = place(here);
    label(pen, "transition", x + 14, y + 26, "warn");
  }
  const proposed = store.doc.operator?.planApproval?.plan?.steps;
  if (proposed) sketch(pen, [here, ...proposed.map((it) => it.goalState?.position)], "plan to approve", "accent");
  const tried = (store.whatIf ?? []).flatMap((it) => it.plan?.steps ?? []);
  if (tried.length) sketch(pen, [here, ...tried.map((it) => it.goalState?.position)], "what if", "old");
}

/** Where the vehicle is, flying on as it does, when it can fly home for the last time with the reserve: a bar across its course. */
function noReturn(pen, here) {
  const turnS = store.doc.energy?.turnHomeS;
  const { northMS = 0, eastMS = 0 } = vehicle()?.velocity ?? {};
  const speed = Math.hypot(northMS, eastMS);
  if (turnS == null || turnS < 0 || speed < 0.5) return;
  const { context, colour } = pen;
  const [x, y] = toScreen((here.northM ?? 0) + northMS * turnS, (here.eastM ?? 0) + eastMS * turnS);
  const across = [(northMS / speed) * 14, (eastMS / speed) * 14];
  context.strokeStyle = colour("warn");
  context.lineWidth = 3;
  line(context, [[x - across[0], y - across[1]], [x + across[0], y + across[1]]]);
  context.stroke();
  label(pen, `turn home by here, in ${clock(turnS)}`, x + 10, y + 18, "warn");
}

/** Where the response under way leads: nothing else on the map is as broad. */
function answer(pen, here, way) {
  const { context, colour } = pen;
  const points = [here, ...way.points.map(place)];
  context.strokeStyle = colour("bad");
  context.lineWidth = 4;
  line(context, points);
  context.stroke();
  const [x, y] = points[points.length - 1];
  context.beginPath();
  context.arc(x, y, 8, 0, 2 * Math.PI);
  context.stroke();
  label(pen, responseWords(way), x + 12, y - 30, "bad");
}

/** The steps of the plan still to fly; the present one as a full line. While something responds none of them is: all are faint. */
function ahead({ context, colour }, start, isAbandoned) {
  const current = isAbandoned ? null : store.doc.plan?.current;
  context.save();
  if (isAbandoned) context.globalAlpha = 0.3;
  let from = start;
  for (const { step } of store.plan.steps.filter((it) => !store.plan.done.has(it.step.id))) {
    const to = goal(step);
    const present = step.id === current?.stepId;
    context.strokeStyle = colour("accent");
    context.lineWidth = present ? 3 : 1.5;
    context.setLineDash(present ? (current.inTransition ? [3, 5] : []) : [8, 6]);
    line(context, [from, to]);
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    context.arc(...to, present ? 5 : 3.5, 0, 2 * Math.PI);
    context.fillStyle = present ? colour("accent") : colour("map");
    context.fill();
    context.lineWidth = 1.5;
    context.stroke();
    from = to;
  }
  context.restore();
}

/** A route that is not flown yet: a broad dotted band, unlike any other line. */
function sketch(pen, positions, words, tone) {
  const { context, colour } = pen;
  const points = positions.map(place);
  context.save();
  context.strokeStyle = colour(tone);
  context.globalAlpha = 0.75;
  context.lineWidth = 5;
  context.lineCap = "round";
  context.setLineDash([1, 11]);
  line(context, points);
  context.stroke();
  context.restore();
  const [farthest] = [...points].sort((a, b) => Math.hypot(b[0] - points[0][0], b[1] - points[0][1]) - Math.hypot(a[0] - points[0][0], a[1] - points[0][1]));
  label(pen, words, (points[0][0] + farthest[0]) / 2 + 8, (points[0][1] + farthest[1]) / 2 - 10, tone);
}

/** Home, and the objectives in order. */
export function sites(pen) {
  const { context, colour } = pen;
  const [homeX, homeY] = toScreen(0, 0);
  context.strokeStyle = colour("ink");
  context.lineWidth = 2;
  line(context, [[homeX - 7, homeY + 1], [homeX, homeY - 7], [homeX + 7, homeY + 1]]);
  context.stroke();
  context.strokeRect(homeX - 4.5, homeY, 9, 7);
  const under = new Map();
  store.doc.mission?.objectives?.forEach((it, index) => {
    const [x, y] = place(it.position);
    const tone = { OBJECTIVE_STATE_SUCCESS: "good", OBJECTIVE_STATE_FAILURE: "bad" }[it.state] ?? (index === store.doc.mission.currentObjective ? "accent" : "muted");
    // The names of objectives at one site stand one below the other.
    const site = `${Math.round(x)},${Math.round(y)}`;
    const row = under.get(site) ?? 0;
    under.set(site, row + 1);
    if (Math.hypot(x - homeX, y - homeY) > 12) {
      context.strokeStyle = colour(tone);
      context.lineWidth = 2;
      context.strokeRect(x - 7, y - 7, 14, 14);
    }
    const glyph = { good: " ✓", bad: " ✕" }[tone] ?? "";
    label(pen, `${index + 1} ${it.name}${glyph}`, x + 12, y + 22 + row * 17, tone);
  });
}
