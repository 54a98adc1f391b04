// Says how old the shown data are, and marks every panel whose source is silent.

import { attribute, text } from "./dom.js";
import { age } from "./words.js";
import { isLate, isSourceStale, isStale, lostFor, silence, sourceAge, store } from "./store.js";

export function mountStaleness() {
  const banner = document.getElementById("staleness");
  const outdated = document.getElementById("outdated");
  document.getElementById("reload").addEventListener("click", () => location.reload());
  const panels = [...document.querySelectorAll("[data-source]")];
  return () => {
    const stale = isStale();
    document.body.classList.toggle("stale", stale);
    for (const panel of panels) {
      attribute(panel, "data-stale", store.doc && isSourceStale(panel.dataset.source) ? "true" : "false");
    }
    attribute(banner, "hidden", !(stale || (store.doc && isSourceStale("introspection"))));
    text(banner, words(stale));
    attribute(outdated, "hidden", !store.outdated);
  };
}

/** What a vehicle in flight does by itself when it does not hear the ground. */
function byItself() {
  const responses = (store.session?.withoutContact ?? []).map((it) => `${it.response} after ${age(it.afterS)}`);
  return responses.length ? `In flight, without contact, it ${responses.join(" and ")}.` : "";
}

/** Seconds without an event, while the gateway answers what is asked, after which something on the way is said to hold the events back. */
const HELD_BACK_S = 5;

/** Why the connection is lost, where it is known. */
function why() {
  if (store.unreached) return `: ${store.unreached}`;
  const answers = performance.now() - store.fleetAt < 3000;
  return answers && HELD_BACK_S < silence() ? ": the gateway answers, but its events do not arrive. A proxy on the way may hold them back" : "";
}

function words(stale) {
  if (store.signIn) return "Not signed in: no data.";
  if (!store.doc) return "No data yet.";
  if (isLate()) return `Everything shown is ${age(silence())} old: events arrive late. The way from the gateway is too narrow for them, or something on it holds them back.`;
  if (stale) return `Connection lost${why()}. No data for ${age(silence())}: everything shown is stale.`;
  if (lostFor() != null) return `No contact with ${store.selected} for ${age(lostFor())}: everything shown is that old. ${byItself()}`;
  const monitor = sourceAge("introspection");
  return `No data from the vehicle's monitor for ${age(monitor)}: position, speed, battery and flags are stale.`;
}
