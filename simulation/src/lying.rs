//! A planner that lies: its answers are falsified on their way. A service that believes it must not get into danger.

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Response, Service, Topic};
use kittiwake_proto::v1::replan_reply::Reply;
use kittiwake_proto::v1::skill_goal::Goal;
use kittiwake_proto::v1::{self, PlanStep, SkillGoal};
use node::{Effect, Event, Node, Token};

use crate::chaos::dice::Dice;

/// A node whose answers to requests for a plan are falsified, two in three.
pub(crate) struct Lying<N> {
    node: N,
    dice: Dice,
}

/// Percent of the answers that are falsified.
const LIES: u64 = 66;

impl<N: Node> Lying<N> {
    /// `seed` draws the lies.
    pub(crate) fn new(node: N, seed: u64) -> Lying<N> {
        Lying { node, dice: Dice(seed) }
    }

    fn falsify(&mut self, effects: &mut [Effect]) {
        for effect in effects {
            let Effect::Reply { response, .. } = effect else { continue };
            match response {
                Response::Replan(reply) if self.dice.sometimes(LIES) => self.answer(reply),
                _ => {}
            }
        }
    }

    fn answer(&mut self, reply: &mut v1::ReplanReply) {
        let Some(Reply::Plan(plan)) = &mut reply.reply else {
            return;
        };
        match self.dice.below(8) {
            0 => plan.steps.reverse(),
            1 => plan.steps.truncate(self.dice.below(plan.steps.len() as u64 + 1) as usize),
            2 => reply.mission = None,
            3 => plan.steps.retain(|it| it.ask_permissions.is_empty()),
            _ => {
                for at in 0..plan.steps.len() {
                    self.step(&mut plan.steps[at]);
                }
            }
        }
    }

    fn step(&mut self, step: &mut PlanStep) {
        match self.dice.below(9) {
            0 => {
                step.ask_permissions.clear();
                step.ask_for_s.clear();
                step.ask_ahead.clear();
            }
            1 => step.ask_for_s.iter_mut().for_each(|it| *it = 0.1),
            2 => step.ask_permissions.iter_mut().for_each(|it| "Z".clone_into(it)),
            3 => step.id = step.id.wrapping_add(1),
            _ => self.goal(step.nominal.get_or_insert_default().goal.get_or_insert_default()),
        }
    }

    fn goal(&mut self, goal: &mut SkillGoal) {
        match (self.dice.below(6), &mut goal.goal) {
            (0, goal) => *goal = Some(Goal::Land(v1::LandGoal::default())),
            (1, goal) => *goal = None,
            (2, goal) => {
                let velocity = v1::NedVelocity { north_m_s: self.metres(15), east_m_s: self.metres(15), down_m_s: 0.0 };
                *goal = Some(Goal::Velocity(v1::VelocityGoal { velocity: Some(velocity), ..Default::default() }));
            }
            (_, Some(Goal::Position(position))) => {
                let (north_m, east_m, down_m) = (self.metres(700), self.metres(700), -10.0 + self.metres(200));
                position.target = Some(v1::Ned { north_m, east_m, down_m });
                position.speed_limit_m_s = if self.dice.sometimes(20) { f64::NAN } else { self.metres(50).abs() };
            }
            (_, Some(Goal::Takeoff(takeoff))) => takeoff.climb_m = self.metres(300),
            _ => {}
        }
    }

    /// From -`most` to `most`.
    fn metres(&mut self, most: i64) -> f64 {
        self.dice.between(-most, most) as f64
    }
}

impl<N: Node> Node for Lying<N> {
    fn name(&self) -> &'static str {
        self.node.name()
    }

    fn subscriptions(&self) -> &'static [Topic] {
        self.node.subscriptions()
    }

    fn serves(&self) -> &'static [Service] {
        self.node.serves()
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        let before = effects.len();
        self.node.on(now, event, effects);
        self.falsify(&mut effects[before..]);
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let before = effects.len();
        self.node.act(now, effects);
        self.falsify(&mut effects[before..]);
    }

    fn answers_later(&self, token: Token) -> bool {
        self.node.answers_later(token)
    }

    fn deadline(&self) -> Option<Time> {
        self.node.deadline()
    }

    fn is_over(&self) -> bool {
        self.node.is_over()
    }
}
