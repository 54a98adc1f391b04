// The areas, coloured by the state of their permissions.

import { store } from "./store.js";
import { place } from "./map-view.js";
import { hatch, label, outline } from "./map-pen.js";
import { TONES, short } from "./permissions.js";
import { number } from "./words.js";
import { awaitedWords, expiryWords, rings } from "./legs.js";

const WORDS = { REQUESTED: "requested", "": "not requested", UNSPECIFIED: "not requested" };

export function area(pen, it) {
  const { context, colour } = pen;
  const keepOut = it.kind === "AREA_KIND_KEEP_OUT";
  const state = short(store.doc.permissions?.find((p) => p.area === it.name)?.state);
  const tone = keepOut ? "bad" : (TONES[state] ?? "muted");
  const border = rings(it).map((ring) => ring.map(place));
  outline(context, border);
  context.fillStyle = colour(tone);
  context.globalAlpha = state === "GRANTED" || state === "REQUESTED" ? 0.16 : 0.09;
  context.fill("evenodd");
  if (keepOut || tone === "bad" || tone === "warn") hatch(pen, border, tone, keepOut);
  context.globalAlpha = 1;
  outline(context, border);
  context.strokeStyle = colour(tone);
  context.lineWidth = keepOut ? 2.5 : 1.5;
  context.setLineDash(TONES[state] || keepOut ? [] : [6, 4]);
  context.stroke();
  context.setLineDash([]);
  // What is round a hole may end far outside the map: its name stands above the hole.
  const named = border[1] ?? border[0];
  const x = Math.min(...named.map((c) => c[0])) + 8;
  const y = Math.min(...named.map((c) => c[1])) + (border[1] ? -24 : 18);
  label(pen, it.name, x, y, "ink", 700);
  const permission = store.doc.permissions?.find((p) => p.area === it.name);
  const expires = permission ? expiryWords(permission) : "";
  const words = keepOut ? "keep out" : (WORDS[state] ?? state.toLowerCase());
  label(pen, words + band(it), x, y + 16, tone, 500);
  const more = awaitedWords(it.name) || expires;
  if (more) label(pen, more, x, y + 32, "warn", 600);
}

function band({ floorM, ceilingM }) {
  if (floorM == null && ceilingM == null) return "";
  return `, ${floorM == null ? "ground" : `${number(floorM)} m`} to ${ceilingM == null ? "any height" : `${number(ceilingM)} m`}`;
}
