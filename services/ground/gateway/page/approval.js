// A plan that waits for approval: what it would fly, how long it waits, and what happens after that.

import { attribute, disabledFor, h, list, text } from "./dom.js";
import { has, inCommand, isCutOff, store } from "./store.js";
import { capital, number } from "./words.js";
import { order } from "./orders.js";

export function approval() {
  const words = h("span", {});
  const left = h("progress", { max: 1, "aria-label": "Time left for a decision" });
  const steps = h("ol", { class: "proposed" });
  const decide = (approve) => () =>
    order(store.selected, approve ? "approve plan" : "reject plan", "plan/decision", { revision: store.doc?.operator?.planApproval?.revision, approve });
  const reject = h("button", { id: "reject", click: decide(false) }, "Reject plan");
  const approve = h("button", { id: "approve", class: "primary", click: decide(true) }, "Approve plan");
  const element = h("div", { class: "confirm", id: "approval", hidden: true }, words, reject, approve, left, steps);
  /** The revision shown, and the longest time to the decision that was seen, in seconds. */
  let longest = { revision: null, seconds: 0 };
  const fill = () => {
    const asked = store.doc?.operator?.planApproval;
    attribute(element, "hidden", !asked);
    if (!asked) return;
    if (longest.revision !== asked.revision) longest = { revision: asked.revision, seconds: 0 };
    longest.seconds = Math.max(longest.seconds, asked.untilS);
    left.value = longest.seconds > 0 ? asked.untilS / longest.seconds : 0;
    text(words, `Plan ${asked.revision} waits for approval. It is ${asked.approveByDefault ? "approved" : "rejected"} by default in ${number(asked.untilS)} s.`);
    list(steps, (asked.plan?.steps ?? []).map((it, index) => ({ ...it, index })), (it) => it.id, () => h("li", {}), (row, it) => text(row, `${it.index + 1}. ${capital(it.text)}`));
    const reason = isCutOff() ? "not connected" : !has("operator") ? "needs the role operator" : inCommand() ? "" : "take command first";
    disabledFor(reject, reason);
    disabledFor(approve, reason);
  };
  return { element, fill };
}
