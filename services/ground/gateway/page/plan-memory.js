// The steps of the present plan together with those already flown, which the vehicle's document does not contain any
// more.

export function noPlan() {
  return { revision: null, steps: [], done: new Set(), longest: 0, current: null };
}

/** The memory of the plan after `doc` has arrived. */
export function rememberPlan(plan, doc) {
  const steps = doc.plan?.actionTrack ?? [];
  const asks = new Map((doc.plan?.communicationTrack ?? []).map((it) => [it.stepId, it]));
  if (doc.plan?.revision !== plan.revision) plan = { ...noPlan(), revision: doc.plan?.revision ?? null };
  for (const step of steps) {
    const known = plan.steps.find((it) => it.step.id === step.id);
    const { askPermissions: ask = [], askAhead: ahead = [] } = asks.get(step.id) ?? {};
    if (known) Object.assign(known, { ask, ahead });
    else plan.steps.push({ step, ask, ahead });
  }
  const current = doc.plan?.current;
  const left = new Set(steps.map((it) => it.id));
  for (const { step } of plan.steps) if (!left.has(step.id)) plan.done.add(step.id);
  if (current?.stepId !== plan.current) Object.assign(plan, { current: current?.stepId ?? null, longest: 0 });
  const index = plan.steps.findIndex((it) => it.step.id === plan.current);
  plan.steps.slice(0, Math.max(0, index)).forEach((it) => plan.done.add(it.step.id));
  plan.longest = Math.max(plan.longest, current?.distanceLeftM ?? 0);
  return plan;
}
