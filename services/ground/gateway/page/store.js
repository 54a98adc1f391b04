// The data of the page: the fleet, the selected vehicle, its events, and the age of its data.
//
// Only this file changes them. The parts of the page read them on every change.

import * as api from "./api.js";
import { NOTHING_HEARD, heard, latenessOf } from "./gateway-clock.js";
import { noPlan, rememberPlan } from "./plan-memory.js";

/** Number of periods without a `status` event, or of its lateness, after which everything shown is stale. */
const STALE_AFTER_PERIODS = 1.7;
/** Published once the control tower has heard of the vehicle: until then its absence is normal. */
const PUBLISHED_LATE = "permissionLedger";
const RECONNECT_MS = 500;
const FLEET_PERIOD_MS = 1000;
/** The statuses of answers that may be others soon: there is none, too much is asked for, or the gateway or a proxy is not able now. */
const FOR_NOW = [0, 429, 502, 503, 504];
const RECALL_AGAIN_MS = 5000;
/** The most samples of the plots: as many as the gateway keeps of a flight. */
const SAMPLES = 3600;
/** The most events: more than a mission has. */
const EVENTS = 2000;
/** The most positions of the trail on the map. */
const TRAIL = 5000;

export const store = {
  /** Who is signed in, and the part of the configuration that the page needs. */
  session: null,
  /** Why a token is needed, for the sign-in form; null when none is. */
  signIn: null,
  /** Why the gateway was not reached when it was asked last; null when it was. */
  unreached: null,
  /** The gateway serves another page than this one, which was loaded before an upgrade. */
  outdated: false,
  vehicles: [],
  fleetAt: -Infinity,
  selected: null,
  /** The selected vehicle's document and when it arrived, by this page's clock. */
  doc: null,
  docAt: -Infinity,
  /** What is known of the gateway's clock. */
  clock: NOTHING_HEARD,
  events: [],
  samples: [],
  /** Where the vehicle has flown. */
  trail: [],
  /** The steps of the present plan, with those already flown. */
  plan: noPlan(),
  /** Whether the operator edits the mission. */
  editing: false,
  /** The planner's forecast for the mission that was tried out, or null. */
  whatIf: null,
  /** The places in the mission's text while it is edited, and how one of them is moved. */
  draft: { places: [], move: () => {} },
};

const listeners = new Set();
const selecting = new Set();
let scheduled = false;
let streaming = null;
let recalling = null;

/** Calls `listener` on every change, at most once a frame. */
export function onChange(listener) {
  listeners.add(listener);
}

/** Calls `listener` when another vehicle is selected, before anything about it is shown. */
export function onSelect(listener) {
  selecting.add(listener);
}

/** Shows what changed, soon. */
export function changed() {
  if (scheduled) return;
  scheduled = true;
  // Not requestAnimationFrame, which pauses in the background: a page that comes to the front must be up to date.
  setTimeout(renew, 16);
}

/** Shows what changed at once: for a new size or theme. */
export function renew() {
  scheduled = false;
  for (const listener of listeners) listener(store);
}

/** Seconds since the last status of the selected vehicle was written. */
export function silence() {
  return sinceArrival() + lateness();
}

function sinceArrival() {
  return (performance.now() - store.docAt) / 1000;
}

/**
 * Seconds by which the last status arrived late, if that makes it stale. Less does not count: a status may be a period old when it
 * leaves, and a clock that is set by a little looks the same.
 */
function lateness() {
  const lateS = store.doc ? latenessOf(store.clock, Date.parse(store.doc.utc), store.docAt) / 1000 : 0;
  return lateS > staleAfterS() ? lateS : 0;
}

function staleAfterS() {
  return STALE_AFTER_PERIODS * periodS();
}

/** Seconds between two statuses. */
function periodS() {
  return 1 / (store.session?.statusRateHz ?? Infinity);
}

/** Whether no status arrives: nothing can be ordered. */
export function isCutOff() {
  return !store.session || sinceArrival() > staleAfterS();
}

/** Whether statuses arrive, and are stale by then. What is ordered goes the other way, and may be in time. */
export function isLate() {
  return !isCutOff() && lateness() > 0;
}

/** Whether everything shown is stale. */
export function isStale() {
  return isCutOff() || isLate();
}

/** Wall seconds since the ground last heard the vehicle, if it is lost; else `null`. */
export function lostFor() {
  const contact = store.doc?.contact;
  return contact?.lost ? contact.wallAgeS + silence() : null;
}

/** Wall seconds since the source's last data reached the gateway, continued by this page's clock. */
export function sourceAge(source) {
  const age = store.doc?.sources?.[source]?.wallAgeS;
  return age == null ? null : age + silence();
}

/** Whether what is shown of a source is stale, because the source or the gateway is silent. */
export function isSourceStale(source) {
  if (isStale()) return true;
  const age = sourceAge(source);
  return age == null ? source !== PUBLISHED_LATE : age > store.doc.sources[source].staleAfterWallS;
}

/** Whether the source was silent when the status was written: what arrives late was true then, and has its place at its time. */
function wasSourceStale(source) {
  const { wallAgeS, staleAfterWallS } = store.doc.sources?.[source] ?? {};
  return wallAgeS == null || wallAgeS > staleAfterWallS;
}

export function has(role) {
  return Boolean(store.session?.roles?.includes(role));
}

/** Whether this session has command of the selected vehicle. */
export function inCommand() {
  return Boolean(store.session && store.doc?.command?.holder === store.session.name);
}

/** Starts the session, the fleet and the stream; and a clock, since ages grow while nothing arrives. */
export async function start() {
  setInterval(changed, 100);
  await openSession();
  for (;;) {
    await pollFleet();
    await new Promise((resolve) => setTimeout(resolve, FLEET_PERIOD_MS));
  }
}

/** Asks the gateway whose token this is. */
export async function openSession() {
  try {
    adopt(await api.get("/api/v1/session"));
    store.signIn = null;
  } catch (refusal) {
    store.session = null;
    store.signIn = refusal.status === 401 ? refusal.message : null;
  }
  changed();
}

/** Which page this is: that of the gateway it was loaded from. */
let page = null;

function adopt(session) {
  store.session = session;
  page ??= session.page;
  store.outdated = page !== session.page;
}

/** After the stream broke: what answers now may be another gateway, with other people, limits or pages. */
async function renewSession() {
  try {
    adopt(await api.get("/api/v1/session"));
  } catch (refusal) {
    if (refusal.status === 401) store.signIn = refusal.message;
  }
  changed();
}

async function pollFleet() {
  if (store.signIn) return;
  try {
    // The gateway renews what it answers once a period, also while it hears nothing.
    const request = store.session && { asked: performance.now(), olderBy: periodS() * 1000 };
    const { vehicles, utc } = await api.get("/api/v1/vehicles");
    store.clock = heard(store.clock, "fleet", Date.parse(utc), performance.now(), request);
    if (!store.session && !store.signIn) await openSession();
    store.vehicles = vehicles;
    store.fleetAt = performance.now();
    store.unreached = null;
    if (!store.selected && vehicles.length) select(vehicles[0].vehicle);
  } catch (refusal) {
    if (refusal.status === 401) store.signIn = refusal.message;
    else store.unreached = refusal.message;
  }
  changed();
}

/** Shows another vehicle. */
export function select(vehicle) {
  if (store.selected === vehicle) return;
  store.selected = vehicle;
  Object.assign(store, { doc: null, docAt: -Infinity, editing: false, whatIf: null });
  forget();
  recall(vehicle);
  streaming?.abort();
  streaming = new AbortController();
  for (const listener of selecting) listener();
  follow(vehicle, streaming.signal);
  changed();
}

function forget() {
  Object.assign(store, { events: [], samples: [], trail: [], plan: noPlan() });
}

/** Fetches where the vehicle has flown before this page was opened. Nothing else asks for that, so it retries until it has an answer. */
async function recall(vehicle) {
  clearTimeout(recalling);
  let points;
  try {
    ({ points } = await api.get(`/api/v1/vehicles/${encodeURIComponent(vehicle)}/track`));
  } catch (refusal) {
    if (store.selected !== vehicle || !FOR_NOW.includes(refusal.status ?? 0)) return;
    clearTimeout(recalling);
    recalling = setTimeout(() => store.selected === vehicle && recall(vehicle), RECALL_AGAIN_MS);
    return;
  }
  if (store.selected !== vehicle) return;
  const before = (list) => points.filter((it) => it.missionTimeS < (list[0]?.at ?? Infinity));
  const samples = before(store.samples).map((it) => ({
    at: it.missionTimeS,
    height: it.heightM,
    speed: it.groundSpeedMS,
    battery: it.batteryRemaining == null ? null : it.batteryRemaining * 100,
  }));
  const trail = before(store.trail).map(({ missionTimeS, position = {} }) => ({ at: missionTimeS, north: position.northM ?? 0, east: position.eastM ?? 0 }));
  store.samples = [...samples, ...store.samples].slice(-SAMPLES);
  store.trail = [...trail, ...store.trail].slice(-TRAIL);
  changed();
}

/** Reads the vehicle's events, and resumes after the last one when the stream breaks. */
async function follow(vehicle, signal) {
  let last = null;
  while (!signal.aborted) {
    // It may be another gateway, whose clock is another one.
    store.clock = NOTHING_HEARD;
    try {
      await api.stream(`/api/v1/vehicles/${encodeURIComponent(vehicle)}/events`, last, signal, (id, type, data) => {
        if (id) last = id;
        onEvent(type, data, id);
      });
    } catch (refusal) {
      if (refusal.status === 401) store.signIn = refusal.message;
    }
    await new Promise((resolve) => setTimeout(resolve, RECONNECT_MS));
    if (!signal.aborted && !store.signIn) await renewSession();
  }
}

function onEvent(type, data, id) {
  if (type === "resync") {
    forget();
    recall(store.selected);
  } else if (type === "status") onStatus(data);
  else {
    if (type === "command" && isNews(data)) store.doc.command = data;
    if (type === "skill" && data.state === "SKILL_STATE_ENDED" && data.position && isNews(data)) extend(data.position, data.missionTimeS);
    store.events.push({ id, type, data, at: data.missionTimeS });
    if (store.events.length > EVENTS) store.events.shift();
  }
  changed();
}

/**
 * Whether this event tells more than the last status, which overtakes events that wait. What is older is in the status, and in the track
 * that is fetched; and before another mission the vehicle was elsewhere.
 */
function isNews({ utc }) {
  return store.doc !== null && Date.parse(store.doc.utc) <= Date.parse(utc);
}

function onStatus(doc) {
  // Another mission: its time begins at zero.
  if (store.doc && doc.missionTimeS < store.doc.missionTimeS - 1) forget();
  const before = store.doc;
  const docAt = performance.now();
  Object.assign(store, { doc, docAt, clock: heard(store.clock, "status", Date.parse(doc.utc), docAt) });
  store.plan = rememberPlan(store.plan, doc);
  // Without the mission's time nothing has its place among what was flown.
  if (wasSourceStale("introspection") || doc.missionTimeS == null) return;
  const aircraft = doc.aircraft;
  const position = aircraft?.localPosition?.position;
  if (position) extend(position, doc.missionTimeS);
  const derived = aircraft?.derived;
  const ticks = before?.tree && doc.tree ? Number(doc.tree.ticks) - Number(before.tree.ticks) : null;
  const seconds = before ? (Date.parse(doc.utc) - Date.parse(before.utc)) / 1000 : 0;
  store.samples.push({
    at: doc.missionTimeS,
    seenAt: docAt,
    height: derived?.heightM,
    speed: derived?.groundSpeedMS,
    battery: aircraft?.battery ? aircraft.battery.remaining * 100 : null,
    tick: doc.tree?.tickTimeMs?.max ?? null,
    tickMedian: doc.tree?.tickTimeMs?.p50 ?? null,
    ticks: ticks != null && seconds > 0 && ticks >= 0 ? ticks / seconds : null,
  });
  if (store.samples.length > SAMPLES) store.samples.shift();
}

function extend({ northM = 0, eastM = 0 }, at) {
  const last = store.trail.at(-1);
  if (last && Math.hypot(last.north - northM, last.east - eastM) < 0.5) return;
  store.trail.push({ at, north: northM, east: eastM });
  if (store.trail.length > TRAIL) store.trail.shift();
}
