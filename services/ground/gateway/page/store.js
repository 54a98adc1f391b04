// What the page knows: the fleet, the chosen vehicle, its history, and how old all of it is.
//
// One writer, here. The parts of the page read it when they are told that it changed.

import * as api from "./api.js";
import { noPlan, rememberPlan } from "./plan-memory.js";

/** Milliseconds without a status (they come at 2 Hz) after which nothing shown may pass as present. */
const STALE_AFTER_MS = 850;
/** Wall seconds after which a source's data are old: the slow ones come at 1 or 2 Hz, the monitor's at 100. */
const SOURCE_LIMIT_S = { introspection: 0.9, mcmStatus: 2, plannerStatus: 3, permissionLedger: 3 };
/** The source that begins to speak when it is first asked something: until then its silence is no trouble. */
const LATE = "permissionLedger";
const RECONNECT_MS = 500;
const FLEET_PERIOD_MS = 1000;
/** Five minutes of plots, and more events than a mission has. */
const SAMPLES = 600;
const EVENTS = 2000;

export const store = {
  session: null,
  /** Why there is no session, for the sign-in form; null when none is needed. */
  signIn: null,
  vehicles: [],
  fleetAt: -Infinity,
  selected: null,
  /** The chosen vehicle's document and when it came, by this page's clock. */
  doc: null,
  docAt: -Infinity,
  events: [],
  samples: [],
  /** Where it has flown. */
  trail: [],
  /** The steps of the present plan, with those already done. */
  plan: noPlan(),
  /** The operator changes the mission; the planner's forecast of what was tried out, or null. */
  editing: false,
  whatIf: null,
};

const listeners = new Set();
let scheduled = false;
let streaming = null;

/** Calls `listener` on every change, at most once a frame. */
export function onChange(listener) {
  listeners.add(listener);
}

/** Tells that something changed; it is shown soon. */
export function changed() {
  if (scheduled) return;
  scheduled = true;
  // Not requestAnimationFrame: a page in the background must not show the past when it comes to the front.
  setTimeout(renew, 16);
}

/** Shows what has changed at once: before a page of another size or theme is looked at. */
export function renew() {
  scheduled = false;
  for (const listener of listeners) listener(store);
}

/** Seconds since the last status of the chosen vehicle. */
export function silence() {
  return (performance.now() - store.docAt) / 1000;
}

/** Whether nothing shown may pass as present. */
export function isStale() {
  return silence() * 1000 > STALE_AFTER_MS;
}

/** Wall seconds since a source's data reached the gateway, counted on by this page's clock. */
export function sourceAge(source) {
  const age = store.doc?.sources?.[source]?.wallAgeS;
  return age == null ? null : age + silence();
}

/** Whether what is shown of a source is old, be it that the source or that the gateway is silent. */
export function isSourceStale(source) {
  if (isStale()) return true;
  const age = sourceAge(source);
  return age == null ? source !== LATE : age > SOURCE_LIMIT_S[source];
}

export function has(role) {
  return Boolean(store.session?.roles?.includes(role));
}

/** Whether this session holds command of the chosen vehicle. */
export function inCommand() {
  return Boolean(store.session && store.doc?.command?.holder === store.session.name);
}

/** Starts: session, fleet, stream; and a clock, since silence is news too. */
export async function start() {
  setInterval(changed, 100);
  await openSession();
  for (;;) {
    await pollFleet();
    await new Promise((resolve) => setTimeout(resolve, FLEET_PERIOD_MS));
  }
}

/** Asks who this is. A gateway without sessions is one to watch only. */
export async function openSession() {
  try {
    store.session = await api.get("/api/v1/session");
    store.signIn = null;
  } catch (refusal) {
    store.session = null;
    store.signIn = refusal.status === 401 ? refusal.message : null;
  }
  changed();
}

async function pollFleet() {
  if (store.signIn) return;
  try {
    const { vehicles } = await api.get("/api/v1/vehicles");
    if (!store.session && !store.signIn && store.fleetAt === -Infinity) await openSession();
    store.vehicles = vehicles;
    store.fleetAt = performance.now();
    if (!store.selected && vehicles.length) select(vehicles[0].vehicle);
  } catch (refusal) {
    if (refusal.status === 401) store.signIn = refusal.message;
  }
  changed();
}

/** Shows another vehicle. */
export function select(vehicle) {
  if (store.selected === vehicle) return;
  store.selected = vehicle;
  Object.assign(store, { doc: null, docAt: -Infinity, editing: false, whatIf: null });
  forget();
  streaming?.abort();
  streaming = new AbortController();
  follow(vehicle, streaming.signal);
  changed();
}

function forget() {
  Object.assign(store, { events: [], samples: [], trail: [], plan: noPlan() });
}

/** Reads the vehicle's events, and reads on from the last one after every break. */
async function follow(vehicle, signal) {
  let last = null;
  while (!signal.aborted) {
    try {
      await api.stream(`/api/v1/vehicles/${encodeURIComponent(vehicle)}/events`, last, signal, (id, type, data) => {
        if (id) last = id;
        take(type, data, id);
      });
    } catch (refusal) {
      if (refusal.status === 401) store.signIn = refusal.message;
    }
    await new Promise((resolve) => setTimeout(resolve, RECONNECT_MS));
  }
}

function take(type, data, id) {
  if (type === "resync") forget();
  else if (type === "status") takeStatus(data);
  else {
    if (type === "command" && store.doc) store.doc.command = data;
    if (type === "skill" && data.state === "SKILL_STATE_ENDED" && data.position) extend(data.position);
    store.events.push({ id, type, data, at: data.missionTimeS });
    if (store.events.length > EVENTS) store.events.shift();
  }
  changed();
}

function takeStatus(doc) {
  // Another start of the system: its mission clock begins anew.
  if (store.doc && doc.missionTimeS < store.doc.missionTimeS) forget();
  const before = store.doc;
  Object.assign(store, { doc, docAt: performance.now() });
  store.plan = rememberPlan(store.plan, doc);
  if (isSourceStale("introspection")) return;
  const aircraft = doc.aircraft;
  const position = aircraft?.localPosition?.position;
  if (position) extend(position);
  const derived = aircraft?.derived;
  const ticks = before?.tree && doc.tree ? Number(doc.tree.ticks) - Number(before.tree.ticks) : null;
  const seconds = before ? (Date.parse(doc.utc) - Date.parse(before.utc)) / 1000 : 0;
  store.samples.push({
    at: doc.missionTimeS,
    height: derived?.heightM,
    speed: derived?.groundSpeedMS,
    battery: aircraft?.battery ? aircraft.battery.remaining * 100 : null,
    tick: doc.tree?.tickTimeMs?.max ?? null,
    tickMedian: doc.tree?.tickTimeMs?.p50 ?? null,
    ticks: ticks != null && seconds > 0 && ticks >= 0 ? ticks / seconds : null,
  });
  if (store.samples.length > SAMPLES) store.samples.shift();
}

function extend({ northM = 0, eastM = 0 }) {
  const last = store.trail.at(-1);
  if (last && Math.hypot(last.north - northM, last.east - eastM) < 0.5) return;
  store.trail.push({ north: northM, east: eastM });
  if (store.trail.length > 5000) store.trail.shift();
}
