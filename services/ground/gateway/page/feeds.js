// Where areas come from: which edition of which data set, and until when it is valid.

import { store } from "./store.js";
import { h, text, attribute } from "./dom.js";

const day = (ms) => new Date(Number(ms)).toISOString().slice(0, 16).replace("T", " ");

/** An edition in words; `OUT OF DATE` where its validity is over or has not begun. */
export function feedWords({ name, provider, issuedUtcMs, validFromUtcMs, validUntilUtcMs }) {
  const now = Date.parse(store.doc?.utc) || Date.now();
  const parts = [`${name}${provider ? ` of ${provider}` : ""}`];
  if (issuedUtcMs != null) parts.push(`issued ${day(issuedUtcMs)}`);
  if (validUntilUtcMs != null) parts.push(`valid until ${day(validUntilUtcMs)}`);
  if (validUntilUtcMs != null && Number(validUntilUtcMs) <= now) parts.push("OUT OF DATE");
  if (validFromUtcMs != null && now < Number(validFromUtcMs)) parts.push(`NOT VALID before ${day(validFromUtcMs)}`);
  return parts.join(", ");
}

/** The words for the feed of each area that came from one, by the area's name. */
export function feedsByArea(doc) {
  const words = new Map();
  for (const feed of doc?.feeds ?? []) {
    const of = feedWords(feed);
    for (const index of feed.areas ?? []) words.set(doc.areas?.[index]?.name, of);
  }
  return words;
}

/** A line for each feed of the mission. */
export function feedLines() {
  const element = h("p", { class: "muted", id: "feeds", hidden: true });
  return {
    element,
    fill() {
      const lines = (store.doc?.feeds ?? []).map((it) => `Airspace: ${feedWords(it)}, areas: ${it.areas?.length ?? 0}.`);
      attribute(element, "hidden", lines.length === 0);
      attribute(element, "data-tone", lines.some((it) => /OUT OF DATE|NOT VALID/.test(it)) ? "warn" : null);
      text(element, lines.join(" "));
    },
  };
}
