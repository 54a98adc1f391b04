//! The resource that all skills share, the vehicle's motion: which skill has it, which one is being
//! started, and what is commanded next.
//!
//! Everything is decided while the event that causes it is handled; the passing of time brings about
//! only what is due.

use std::collections::VecDeque;
use std::time::Duration;

use domain::fmu::{Command, CommandResult, Status};
use domain::task::{REPEAT, Task};
use domain::time::{Now, Pace, Time};
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use crate::commands::{Acknowledgement, CommandLine, InFlight, Purpose};
use crate::config::Config;
use crate::control::Control;
use crate::farewell::Farewell;
use crate::fsm::{Action, Ending, Event, SkillId, SkillState};
use crate::idle::{IdleCare, needs_loiter};
use crate::messages::{Input, Output, SkillReport, TaskOrder, TaskReport, TaskState};
use crate::mode_watch::left_to_autopilot;
use crate::skill_run::{Aftermath, SkillRun, Start};
use crate::slots::Slots;
use crate::stream::SetpointStream;
use crate::tracks::Tracks;
use crate::vehicle::{FlightStatus, Vehicle, View, at_wall_rate};

/// How long another skill waits for a task whose `interrupt_s` is not known here. (ENG: half of the longest.)
const ORPHAN: Duration = Duration::from_secs(5);
/// How many tasks are remembered that got the order to end. (ENG: more than processes that do not obey.)
const MOST_DISMISSED: usize = 16;

/// The skills that run or wait, and the autopilot that they command.
#[derive(Debug)]
pub(crate) struct Resource {
    slots: Slots,
    vehicle: Vehicle,
    commands: CommandLine,
    control: Control,
    stream: SetpointStream,
    idle: IdleCare,
    /// A takeoff armed the vehicle and then did not take off.
    disarm_due: bool,
    /// A failsafe of the autopilot's own has pre-empted a takeoff: once it is over the autopilot would go on with that.
    pre_empted_takeoff: bool,
    /// How long a request waits for vehicle data.
    data_wait: Duration,
    /// From an acknowledgement until the status must show the mode.
    mode_limit: Duration,
    feedback_period: Duration,
    /// Tasks along the flight.
    tracks: Tracks,
    /// The tasks that were given up, until their processes have ended them.
    farewells: Vec<Farewell>,
    task_repeat: Duration,
    /// The last tasks that got the order to end: each gets it once.
    dismissed: VecDeque<String>,
    /// What is to be published, in order.
    outbox: Vec<Output>,
}

impl Resource {
    /// No skill runs, and the vehicle was never heard.
    pub(crate) fn new(config: &Config, pace: Pace) -> Resource {
        Resource {
            slots: Slots::default(),
            vehicle: Vehicle::new(config, pace),
            commands: CommandLine::new(pace.limit(config.ack_timeout_s.seconds())),
            control: Control::default(),
            stream: SetpointStream::new(pace.wall(config.setpoint_rate_hz.period())),
            idle: IdleCare::new(pace.limit(config.loiter_after_s.seconds()), config.loiter_tries),
            disarm_due: false,
            pre_empted_takeoff: false,
            data_wait: at_wall_rate(pace, config.data_wait_s.seconds()),
            mode_limit: at_wall_rate(pace, config.mode_timeout_s.seconds()),
            feedback_period: pace.wall(config.feedback_rate_hz.period()),
            tracks: Tracks::default(),
            farewells: Vec::new(),
            task_repeat: pace.wall(REPEAT),
            dismissed: VecDeque::new(),
            outbox: Vec::new(),
        }
    }

    /// The autopilot has said something.
    pub(crate) fn receive(&mut self, input: Input, now: Now) {
        match input {
            Input::Position(position) => self.vehicle.moved(position, now.time),
            Input::Status(status) => self.reported(&status, now),
            Input::Landed(landed) => self.vehicle.land_detected(landed, now.time),
            Input::Task(report) => {
                self.farewells.retain(|it| !it.is_ended_by(&report));
                self.tracks.hear(&report, now.time);
                if let Some(run) = self.slots.registered_mut() {
                    run.hear(&report, now.time);
                }
                self.end_orphan(report, now);
            }
            Input::Acknowledged(ack) => {
                if let Some(command) = self.commands.acknowledged(ack.id) {
                    self.settled(command, &Acknowledgement::Answered(ack.result), now);
                }
            }
        }
        self.proceed(now);
    }

    /// A task runs in flight that this skill manager does not know: the one before has died, or another process has ended the same task. It gets
    /// the order to end, once. On the ground somebody may examine a process.
    fn end_orphan(&mut self, report: TaskReport, now: Now) {
        let TaskReport { skill, request_id, state, .. } = report;
        let is_ours =
            self.tracks.has(&request_id) || self.slots.registered().is_some_and(|it| it.is_requested_as(&request_id));
        if state != TaskState::Running
            || self.view(now).flying != Some(true)
            || is_ours
            || !self.farewells.is_empty()
            || self.dismissed.contains(&request_id)
        {
            return;
        }
        let order = TaskOrder { request_id, task: Task { skill, inputs: Vec::new() }, cancel: true };
        self.dismiss(order, ORPHAN, now);
    }

    /// A task goes on in its process only, which gets the order to end it. Another skill waits for as long as that may take.
    fn dismiss(&mut self, order: TaskOrder, takes: Duration, now: Now) {
        if self.dismissed.len() == MOST_DISMISSED {
            self.dismissed.pop_front();
        }
        self.dismissed.push_back(order.request_id.clone());
        self.farewells.push(Farewell::begin(order, takes, self.task_repeat, now.time));
    }

    /// What has become of tasks along a flight. Nothing waits for their processes.
    fn tell_of_tracks(&mut self, (reports, orders): (Vec<SkillReport>, Vec<TaskOrder>), now: Now) {
        self.outbox.extend(reports.into_iter().map(Output::Report));
        orders.into_iter().for_each(|it| self.dismiss(it, Duration::ZERO, now));
    }

    /// Nothing flies the vehicle that tasks could go along with.
    fn end_tracks(&mut self, now: Now) {
        let ended = self.tracks.follow(Vec::new());
        self.tell_of_tracks(ended, now);
    }

    /// Does what is due.
    pub(crate) fn time_passed(&mut self, now: Now) {
        if let Some(command) = self.commands.give_up(now.time) {
            // An acknowledgement may be lost on its way; what the vehicle does counts more.
            if self.vehicle.obeys(command.command) {
                self.settled(command, &Acknowledgement::Answered(CommandResult::Accepted), now);
            } else if !command.is_repeated() && self.is_wanted(command.purpose) && self.may_send(command.purpose, now) {
                self.vehicle.commanded(command.command, now.time);
                self.outbox.push(Output::Command(self.commands.repeat(command, now)));
            } else {
                self.settled(command, &Acknowledgement::Missing, now);
            }
        }
        self.proceed(now);
        self.refresh_setpoint(now.time);
        let view = self.view(now);
        let feedback = self.slots.registered_mut().and_then(|it| it.feedback(&view, now.time, self.feedback_period));
        self.outbox.extend(feedback.map(Output::Feedback));
    }

    /// When [`Resource::time_passed`] has something to do.
    pub(crate) fn deadline(&self) -> Option<Time> {
        let registered = self.slots.registered();
        let progress = registered.and_then(SkillRun::deadline);
        let feedback = registered.and_then(SkillRun::feedback_deadline);
        let is_free = !self.commands.is_busy();
        let waiting = self.slots.candidate().filter(|_| is_free).and_then(|it| it.wait_deadline(self.data_wait));
        let loiter = self.idle.loiter_due().filter(|_| is_free && self.slots.are_idle());
        let farewells = self.farewells.iter().filter_map(Farewell::deadline).min();
        let (tracks, commands, stream) = (self.tracks.deadline(), self.commands.deadline(), self.stream.deadline());
        [progress, feedback, waiting, loiter, farewells, tracks, commands, stream].into_iter().flatten().min()
    }

    /// The vehicle data that are recent enough at this moment.
    pub(crate) fn view(&self, now: Now) -> View {
        self.vehicle.view(now.time)
    }

    /// The skill that a request which does not replace is refused for.
    pub(crate) fn running(&self) -> Option<&SkillRun> {
        self.slots.running()
    }

    /// What is to be published since the last call, in order.
    pub(crate) fn take_outputs(&mut self) -> Vec<Output> {
        std::mem::take(&mut self.outbox)
    }

    /// Takes a new request. It displaces those that have commanded nothing yet.
    pub(crate) fn enqueue(&mut self, mut run: SkillRun, now: Now) {
        self.announce(&run, now);
        self.pre_empted_takeoff = false;
        for displaced in self.slots.take_waiting() {
            run.inherit(&displaced);
            self.stream.stop_if_of(displaced.id());
            self.drive(displaced, Event::Overwritten { by: run.id() }, now);
        }
        self.slots.enqueue(run);
    }

    /// Cancels a skill; false if it neither runs nor waits.
    pub(crate) fn cancel(&mut self, id: SkillId, now: Now) -> bool {
        let Some(run) = self.slots.take(id) else { return false };
        self.drive(run, Event::Cancel, now);
        self.proceed(now);
        true
    }

    /// How it is known that somebody else flies the vehicle; `None`: nobody else does.
    pub(crate) fn flown_by_other(&self) -> Option<&str> {
        self.control.other()
    }

    /// An operator has ordered to take control back: what is requested from now on is flown.
    pub(crate) fn take_control_back(&mut self) {
        self.control.take_back();
    }

    /// Looks at what runs, then at what is to be commanded.
    pub(crate) fn proceed(&mut self, now: Now) {
        let view = self.view(now);
        self.farewells.retain(|it| !it.is_over(now.time));
        let ending = self.slots.registered_mut().and_then(|it| it.progress(&view, now.time));
        self.end_registered(ending, now);
        let ended = self.tracks.proceed(&view, now.time);
        self.tell_of_tracks(ended, now);
        self.command_next(now);
        let begins = self.slots.registered_mut().and_then(|it| it.take_order(now.time));
        let along = self.tracks.take_orders(self.farewells.is_empty(), now.time);
        let ends: Vec<TaskOrder> = self.farewells.iter_mut().filter_map(|it| it.take_order(now.time)).collect();
        self.outbox.extend(ends.into_iter().chain(along).chain(begins).map(Output::Task));
    }

    fn reported(&mut self, status: &Status, now: Now) {
        if self.vehicle.take_repetition(status) {
            return;
        }
        if self.vehicle.reported(status, self.commands.is_busy(), now.time) {
            self.frame_moved(now);
        }
        let (settled, is_busy) = (!self.commands.is_busy(), !self.slots.are_empty());
        let stands = self.view(now).flying == Some(false);
        if self.control.judge(FlightStatus::from(status), &status.reason, settled, is_busy, stands).is_some() {
            self.go_quiet(now);
        }
        self.judge_mode(now);
    }

    /// Somebody else flies: nothing is commanded any more, not even what would undo a command, and nothing is streamed. (PX4
    /// resumes offboard by itself when setpoints return.)
    fn go_quiet(&mut self, now: Now) {
        self.commands.abandon();
        let how = self.control.other().unwrap_or_default();
        let ending = Ending::because(SkillOutcome::Preempted, format!("somebody else flies: {how}"));
        for run in self.slots.take_those(|_| true) {
            self.end(run, ending.clone(), now);
        }
        (self.disarm_due, self.pre_empted_takeoff) = (false, false);
        self.release(now);
    }

    /// Places and heights from before mean nothing any more: what flies to them ends, and the vehicle is held at once.
    fn frame_moved(&mut self, now: Now) {
        self.control.expect_nothing();
        let reason = "the autopilot's local frame moved, or it was started again: the goal means nothing any more";
        for run in self.slots.take_those(SkillRun::depends_on_frame) {
            self.end(run, Ending::because(SkillOutcome::Failed, reason), now);
            self.stream.stop();
            self.idle.begin_at_once(now.time);
        }
    }

    /// Ends a skill, whether it flies or waits.
    fn end(&mut self, run: SkillRun, ending: Ending, now: Now) {
        let event = if run.is_starting() { Event::Refused(ending) } else { Event::Done(ending) };
        self.drive(run, event, now);
    }

    /// Ends the registered skill if a status shows that the vehicle flies something else.
    fn judge_mode(&mut self, now: Now) {
        let Some(status) = self.view(now).status else { return };
        let (limit, why) = (self.mode_limit, self.vehicle.reason());
        let ending = self.slots.registered_mut().and_then(|it| it.judge_mode(status, why, now.time, limit));
        self.end_registered(ending, now);
    }

    fn end_registered(&mut self, ending: Option<Ending>, now: Now) {
        let Some(ending) = ending else { return };
        if let Some(run) = self.slots.take_registered() {
            self.drive(run, Event::Done(ending), now);
        }
    }

    /// Sends what comes first, if anything can be sent. Nothing queues commands: each is chosen when it
    /// can be sent, from the data of that moment.
    fn command_next(&mut self, now: Now) {
        self.undo_pre_empted_takeoff(now);
        while !self.commands.is_busy() {
            if std::mem::take(&mut self.disarm_due) {
                self.command(Command::Disarm, Purpose::UndoArming, now);
            } else if let Some((id, neutral)) = self.slots.take_neutral() {
                if self.may_send(Purpose::Cancel(id), now) {
                    self.command(neutral, Purpose::Cancel(id), now);
                } else {
                    self.leave_to_autopilot(now);
                }
            } else if let Some(candidate) = self.slots.take_candidate() {
                if !self.start(candidate, now) {
                    return;
                }
            } else if !self.slots.promote() {
                return self.care_for_idle(now);
            }
        }
    }

    /// A takeoff that was pre-empted before the vehicle has left the ground does not go on by itself when the failsafe
    /// is over: people beside the vehicle have seen the autopilot give it up. It is forgotten once the vehicle has
    /// really lifted off, not by a land detector that reports the air for a moment; nothing is disarmed while it does.
    fn undo_pre_empted_takeoff(&mut self, now: Now) {
        let view = self.view(now);
        let Some(status) = view.status.filter(|_| self.pre_empted_takeoff) else { return };
        let has_lifted_off = view.flying == Some(true) && !view.is_near_ground;
        self.pre_empted_takeoff = status.armed && !status.of_other && !has_lifted_off;
        // One that is rejected is sent again with the next status.
        self.disarm_due |= self.pre_empted_takeoff && view.flying == Some(false) && !status.failsafe;
    }

    /// Whether a command may be sent for this purpose: while the autopilot flies a failsafe of its own, only those of a skill that may
    /// override it, and one that disarms on the ground. To cancel what was flown is no reason to end a failsafe.
    fn may_send(&self, purpose: Purpose, now: Now) -> bool {
        let overrides = || match purpose {
            Purpose::Start(id) => self.slots.candidate().is_some_and(|it| it.id() == id && it.may_override_failsafe()),
            Purpose::UndoArming => true,
            Purpose::Cancel(_) | Purpose::Idle | Purpose::Abandoned => false,
        };
        self.view(now).failsafe.is_none() || overrides()
    }

    /// The registered skill, which is being cancelled, ends without a command: the autopilot flies a failsafe of its own. One that cannot
    /// be undone goes on to its own end.
    fn leave_to_autopilot(&mut self, now: Now) {
        let failsafe =
            self.view(now).failsafe.filter(|_| !self.slots.registered().is_some_and(SkillRun::goes_on_when_cancelled));
        let ending = failsafe.map(|status| left_to_autopilot(status, self.vehicle.reason()));
        self.end_registered(ending, now);
    }

    fn command(&mut self, command: Command, purpose: Purpose, now: Now) {
        self.vehicle.commanded(command, now.time);
        self.outbox.push(Output::Command(self.commands.send(command, purpose, now)));
    }

    /// Commands loiter if no skill flies the vehicle, and that is due and needed.
    fn care_for_idle(&mut self, now: Now) {
        let is_due = self.idle.loiter_due().is_some_and(|due| due <= now.time);
        if !is_due || !self.slots.are_idle() {
            return;
        }
        if needs_loiter(&self.view(now)) && self.may_send(Purpose::Idle, now) {
            self.end_tracks(now);
            self.command(Command::Loiter, Purpose::Idle, now);
        } else {
            self.release(now);
        }
    }

    /// Takes the candidate one command further; false if it waits for data. One that is to be replaced sends no further command, not even
    /// if another of its kind replaces it: what it has commanded so far is undone, and the next one starts from there.
    fn start(&mut self, mut candidate: SkillRun, now: Now) -> bool {
        if let Some(by) = self.slots.next().map(SkillRun::id) {
            self.drive(candidate, Event::Overwritten { by }, now);
            return true;
        }
        // What goes on in another process ends before the vehicle moves.
        if let Some(task) = self.slots.take_registered_if(|it| it.order_to_end().is_some()) {
            self.drive(task, Event::Overwritten { by: candidate.id() }, now);
        }
        // A task has its payload for itself; a flight waits only for what must be safe first.
        let is_task = candidate.kind() == SkillKind::Task;
        if self.farewells.iter().any(|it| is_task || it.blocks(now.time)) {
            self.slots.put(candidate);
            return false;
        }
        match candidate.start(&self.view(now), self.vehicle.reason(), now.time, self.data_wait) {
            Start::Wait => {
                self.slots.put(candidate);
                return false;
            }
            Start::Without(event) => {
                let holds = event == Event::AlreadyTrue;
                self.drive(candidate, event, now);
                self.end_registered(holds.then(Ending::success), now);
            }
            Start::Command(command) => {
                if self.stream.prepare(candidate.id(), candidate.setpoint(), now.time) {
                    self.refresh_setpoint(now.time);
                }
                self.command(command, Purpose::Start(candidate.id()), now);
                self.slots.put(candidate);
            }
        }
        true
    }

    /// A command was acknowledged or given up.
    fn settled(&mut self, InFlight { command, purpose, .. }: InFlight, ack: &Acknowledgement, now: Now) {
        match ack {
            Acknowledgement::Answered(CommandResult::Rejected { .. }) => self.vehicle.rejected(command),
            _ if purpose == Purpose::Abandoned => {}
            Acknowledgement::Answered(CommandResult::Accepted) => self.control.commanded(command),
            Acknowledgement::Missing => self.control.expect_nothing(),
        }
        match purpose {
            Purpose::Start(id) => {
                // One that is to be replaced has had its tries.
                let may_try_again = self.is_wanted(purpose);
                if let Some(mut candidate) = self.slots.take_candidate_if(id) {
                    let again = self.may_be_too_early(id, command, now.time).filter(|_| may_try_again);
                    if again.is_some_and(|at| candidate.tries_again(ack, at)) {
                        return self.drive(candidate, Event::TooEarly, now);
                    }
                    match candidate.start_acknowledged(command, ack) {
                        Some(event) => self.drive(candidate, event, now),
                        None => self.slots.put(candidate),
                    }
                }
            }
            Purpose::Cancel(id) => match self.slots.take_cancelling(id) {
                Some(run) if ack.is_accepted() && run.goes_on_when_cancelled() => self.slots.put(run),
                Some(run) if ack.is_accepted() => self.drive(run, Event::Neutral, now),
                Some(run) => {
                    let reason = format!("cancel: {}", ack.describe(command));
                    self.drive(run, Event::NeutralRefused(reason), now);
                }
                // The skill has ended meanwhile; but the vehicle loiters now.
                None if ack.is_accepted() && self.slots.registered().is_none() => self.release(now),
                None => {}
            },
            Purpose::UndoArming | Purpose::Abandoned => {}
            // Without setpoints the autopilot's own failsafe holds the vehicle, if it does not loiter.
            Purpose::Idle if self.idle.is_idle() => {
                self.stream.stop();
                self.idle.loiter_answered(ack.is_accepted(), now.time);
            }
            Purpose::Idle => {}
        }
    }

    /// Whether a command that nothing was heard of is sent once more, as MAVLink's command protocol demands: the command or its
    /// acknowledgement may be lost, or the autopilot's computer was busy.
    fn is_wanted(&self, purpose: Purpose) -> bool {
        match purpose {
            Purpose::Start(id) => self.slots.is_being_started(id),
            Purpose::Cancel(id) => self.slots.is_being_cancelled(id),
            Purpose::UndoArming => true,
            // The second is tried more often than that, each time with a look whether it is still needed.
            Purpose::Abandoned | Purpose::Idle => false,
        }
    }

    /// When a refused command has a chance, since the vehicle was in another state than it will be in then.
    fn may_be_too_early(&self, skill: SkillId, command: Command, now: Time) -> Option<Time> {
        match command {
            // It is taken only once there are setpoints, and on a busy machine or link it can overtake the first of them.
            Command::Offboard if self.stream.is_of(skill) => Some(now + self.stream.time_for_two()),
            // An autopilot disarms by itself some time after a landing: maybe between the status that showed the vehicle armed
            // and the command. The next status decides.
            Command::Takeoff { .. } => Some(now),
            _ => None,
        }
    }

    /// Takes an event to a skill, does what it demands, and puts the skill where it belongs then.
    fn drive(&mut self, mut run: SkillRun, event: Event, now: Now) {
        let mut is_neutral = false;
        for action in run.take(event) {
            match action {
                Action::Register => self.register(&mut run, now),
                // A vehicle that stands is neutral.
                Action::RequestNeutral if run.stands() => is_neutral = true,
                Action::RequestNeutral => run.request_neutral(),
                Action::Announce => self.announce(&run, now),
            }
        }
        match run.state() {
            SkillState::Cancel if is_neutral => self.drive(run, Event::Neutral, now),
            SkillState::ProcessRequest(_) | SkillState::Execute { .. } | SkillState::Cancel => self.slots.put(run),
            SkillState::Report(_) | SkillState::Abort { .. } => self.drive(run, Event::Sent, now),
            SkillState::Ended(ending) => self.ended(&run, ending.outcome, now),
        }
    }

    fn register(&mut self, run: &mut SkillRun, now: Now) {
        if let Some(old) = self.slots.take_registered() {
            self.drive(old, Event::Overwritten { by: run.id() }, now);
        }
        run.register(now.time);
        let tracks = self.tracks.follow(run.take_along());
        self.tell_of_tracks(tracks, now);
        self.idle.end();
        self.stream.switch(run.id(), run.setpoint(), run.has_commanded(), now.time);
        self.refresh_setpoint(now.time);
    }

    fn ended(&mut self, run: &SkillRun, outcome: SkillOutcome, now: Now) {
        self.pre_empted_takeoff |= outcome == SkillOutcome::Preempted && run.takes_off();
        if let Some((order, takes)) = run.order_to_end() {
            self.dismiss(order, takes, now);
        }
        match run.aftermath(outcome) {
            Aftermath::Replaced => {}
            Aftermath::Released => self.release(now),
            Aftermath::Idle => self.idle.begin(now.time),
            Aftermath::NeverFlew => self.never_flew(run, outcome, now),
        }
    }

    fn never_flew(&mut self, run: &SkillRun, outcome: SkillOutcome, now: Now) {
        self.disarm_due |= run.has_only_armed();
        if run.is_unacknowledged() && self.slots.registered().is_none() {
            // The vehicle may fly it nevertheless.
            self.idle.begin(now.time);
        } else {
            self.stream.stop_if_of(run.id());
        }
        match self.slots.next_mut() {
            _ if outcome == SkillOutcome::Cancelled => {}
            // The request that waits may replace it, without a loiter in between.
            Some(next) => next.inherit(run),
            None => {
                for &id in run.gave_up() {
                    self.cancel(id, now);
                }
            }
        }
    }

    /// The autopilot flies the vehicle, or it is on the ground: nothing is streamed any longer.
    fn release(&mut self, now: Now) {
        self.end_tracks(now);
        self.idle.end();
        self.stream.stop();
    }

    fn refresh_setpoint(&mut self, now: Time) {
        self.outbox.extend(self.stream.due(now).map(Output::Setpoint));
    }

    fn announce(&mut self, run: &SkillRun, now: Now) {
        let flown_by_other = self.control.other().is_some();
        let report = SkillReport { flown_by_other, ..run.report(&self.view(now)) };
        self.outbox.push(Output::Report(report));
    }
}
