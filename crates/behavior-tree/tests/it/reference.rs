//! A mission manager's tree of realistic size, for the allocation tests and the bench `engine`, which includes this file.

#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

use std::fmt::Write;
use std::time::{Duration, Instant};

use behavior_tree::{
    BuildError, In, Leaf, LeafResult, Library, NodeSpec, Object, Out, Port, PortValue, Ports, Registry, Status,
    Template, Tree,
};

/// Flags that a monitor may raise.
pub const FLAGS: usize = 16;

#[derive(Clone, Debug)]
pub struct Goal {
    pub north: f64,
}

impl Object for Goal {
    const NAME: &'static str = "Goal";
}

/// What the leaves read and write.
#[derive(Default)]
pub struct World {
    /// The flag the monitor raises in the next tick.
    pub raise: Option<usize>,
    pub raised_at: Option<Instant>,
    /// From the writing of the flag to the start of the action that responds to it.
    pub reaction: Option<Duration>,
    pub step: Option<Template<World>>,
    pub started: u64,
    pub halted: u64,
}

/// Runs forever and writes the flags.
struct Monitor {
    error: Out<bool>,
    flags: Vec<Out<bool>>,
    groups: Vec<Out<bool>>,
    is_written: bool,
}

impl Monitor {
    fn build(spec: &NodeSpec<'_>) -> Result<Self, BuildError> {
        let flags = (0..FLAGS).map(|flag| spec.output(&format!("flag_{flag}"))).collect::<Result<_, _>>()?;
        let groups = (0..FLAGS / 4).map(|group| spec.output(&format!("group_{group}"))).collect::<Result<_, _>>()?;
        Ok(Monitor { error: spec.output("error")?, flags, groups, is_written: false })
    }

    fn write(&self, ports: &mut Ports<'_>, raised: Option<usize>) {
        self.flags.iter().enumerate().for_each(|(flag, port)| ports.write(*port, raised == Some(flag)));
        let raised_group = raised.map(|flag| flag / 4);
        self.groups.iter().enumerate().for_each(|(group, port)| ports.write(*port, raised_group == Some(group)));
        ports.write(self.error, raised.is_some());
    }
}

impl Leaf<World> for Monitor {
    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if !self.is_written {
            self.write(ports, None);
            self.is_written = true;
        }
        if let Some(flag) = world.raise.take() {
            world.raised_at = Some(Instant::now());
            ports.write(self.flags[flag], true);
            ports.write(self.groups[flag / 4], true);
            ports.write(self.error, true);
        }
        Ok(Status::Running)
    }

    fn halt(&mut self, _: &mut World, _: &mut Ports<'_>) {
        self.is_written = false;
    }
}

/// Succeeds while its flag is (or is not) raised.
struct Check {
    flag: In<bool>,
    wanted: bool,
}

impl Leaf<World> for Check {
    fn tick(&mut self, _: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        Ok(Status::from_bool(ports.read(self.flag)? == self.wanted))
    }
}

/// The action that responds to a flag.
struct Stop;

impl Leaf<World> for Stop {
    fn start(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        world.reaction = world.raised_at.take().map(|raised| raised.elapsed());
        Ok(Status::Running)
    }

    fn tick(&mut self, _: &mut World, _: &mut Ports<'_>) -> LeafResult {
        Ok(Status::Running)
    }
}

/// Runs until it is halted: the flight of a step, a request for permission.
struct Work {
    goal: In<Goal>,
}

impl Leaf<World> for Work {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        world.started += u64::from(ports.read(self.goal)?.north.is_finite());
        Ok(Status::Running)
    }

    fn tick(&mut self, _: &mut World, _: &mut Ports<'_>) -> LeafResult {
        Ok(Status::Running)
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        world.halted += 1;
    }
}

/// Builds the step's tree when it is started, and passes its ticks on to the tree.
#[derive(Default)]
struct Executor {
    step: Option<Tree<World>>,
}

impl Leaf<World> for Executor {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let template = world.step.as_ref().ok_or("there is no next step")?;
        self.step = Some(template.instantiate_with(&[("goal", goal())], ports.waker())?);
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let step = self.step.as_mut().ok_or("no step was started")?;
        Ok(ports.tick_tree(step, world))
    }

    fn halt(&mut self, world: &mut World, ports: &mut Ports<'_>) {
        if let Some(mut step) = self.step.take() {
            ports.halt_tree(&mut step, world);
        }
    }

    fn subtree(&self) -> Option<&Tree<World>> {
        self.step.as_ref()
    }
}

pub fn goal() -> behavior_tree::Value {
    Goal { north: 500.0 }.into_value()
}

pub fn registry() -> Registry<World> {
    let mut registry = Registry::new();
    let flags = (0..FLAGS).map(|flag| Port::output::<bool>(&format!("flag_{flag}")));
    let groups = (0..FLAGS / 4).map(|group| Port::output::<bool>(&format!("group_{group}")));
    registry.action("Monitor", flags.chain(groups).chain([Port::output::<bool>("error")]), Monitor::build);
    registry.leaf(behavior_tree::LeafClass::Condition, "IsRaised", [Port::input::<bool>("flag")], |spec| {
        Ok(Check { flag: spec.input("flag")?, wanted: true })
    });
    registry.leaf(behavior_tree::LeafClass::Condition, "IsNotRaised", [Port::input::<bool>("flag")], |spec| {
        Ok(Check { flag: spec.input("flag")?, wanted: false })
    });
    registry.condition("Holds", [], |_, _| Ok(true));
    registry.action("Stop", [], |_| Ok(Stop));
    registry.action("Work", [Port::input::<Goal>("goal")], |spec| Ok(Work { goal: spec.input("goal")? }));
    registry.action("Executor", [], |_| Ok(Executor::default()));
    registry.sync_action("Done", [], |_, _| Ok(true));
    registry
}

const STEP: &str = r#"<Sequence><Holds/><ReactiveSequence><Holds/><Work goal="{goal}"/></ReactiveSequence></Sequence>"#;

/// The step's tree, alone or with three requests for permission beside it.
pub fn step_xml(with_requests: bool) -> String {
    let request = r#"<Work goal="{goal}"/>"#;
    let root = match with_requests {
        false => STEP.to_owned(),
        true => format!(
            r#"<Parallel success_count="1" failure_count="1"><SuccessIsRunning>{STEP}</SuccessIsRunning>
            <Parallel success_count="-1" failure_count="1">{request}{request}{request}</Parallel></Parallel>"#
        ),
    };
    format!(
        r#"<root BTCPP_format="4"><BehaviorTree ID="Step">{root}</BehaviorTree>
        <TreeNodesModel><SubTree ID="Step"><input_port name="goal" type="Goal"/></SubTree></TreeNodesModel></root>"#
    )
}

/// The whole tree. The sixteen contingencies are in one list, or in four groups of four.
pub fn mission_xml(nested: bool) -> String {
    let row = |flag: usize| {
        format!(
            r#"<Sequence><IsRaised flag="{{flag_{flag}}}"/><Fallback><Stop/><Stop/><Stop/></Fallback><Done/></Sequence>"#
        )
    };
    let mut rows = String::new();
    for group in 0..FLAGS / 4 {
        let inside: String = (0..4).map(|place| row(group * 4 + place)).collect();
        // Writing to a string cannot fail.
        let _ = match nested {
            false => write!(rows, "{inside}"),
            true => write!(
                rows,
                r#"<ReactiveSequence><IsRaised flag="{{group_{group}}}"/><ReactiveFallback>{inside}</ReactiveFallback></ReactiveSequence>"#
            ),
        };
    }
    let flags: String = (0..FLAGS).map(|flag| format!(r#" flag_{flag}="{{flag_{flag}}}""#)).collect();
    let groups: String = (0..FLAGS / 4).map(|group| format!(r#" group_{group}="{{group_{group}}}""#)).collect();
    format!(
        r#"<root BTCPP_format="4"><BehaviorTree ID="Mission">
        <Parallel failure_count="1"><Monitor{flags}{groups} error="{{error}}"/>
        <KeepRunningUntilFailure><ReactiveFallback>
          <ReactiveSequence><Holds/><IsNotRaised flag="{{error}}"/>
            <Fallback><Sequence><Executor/><Done/></Sequence>
              <Parallel success_count="1" failure_count="1"><Stop/>
                <SuccessIsRunning><Fallback><Stop/><AlwaysFailure/></Fallback></SuccessIsRunning></Parallel>
            </Fallback></ReactiveSequence>
          <ReactiveFallback>{rows}</ReactiveFallback>
          <Sequence><Done/><AlwaysFailure/></Sequence>
        </ReactiveFallback></KeepRunningUntilFailure></Parallel></BehaviorTree></root>"#
    )
}

/// `count` conditions in sequences of ten, below one sequence.
pub fn conditions_xml(count: usize) -> String {
    let tens = format!("<Sequence>{}</Sequence>", "<Holds/>".repeat(10)).repeat(count / 10);
    format!(r#"<root BTCPP_format="4"><BehaviorTree ID="Wide"><Sequence>{tens}</Sequence></BehaviorTree></root>"#)
}

pub fn template(xml: &str, id: &str) -> Template<World> {
    let library = Library::load(&registry(), [("reference.xml", xml)]).unwrap_or_else(|errors| panic!("{errors}"));
    library.template(id).expect("the tree is in the file")
}

/// The whole tree while it flies a nominal step, with three requests running.
pub fn flying(nested: bool) -> (Tree<World>, World) {
    let mut world = World { step: Some(template(&step_xml(true), "Step")), ..World::default() };
    let mut tree = template(&mission_xml(nested), "Mission").instantiate(&[]).expect("no parameters");
    tree.tick_once(Duration::ZERO, &mut world);
    tree.tick_once(Duration::ZERO, &mut world);
    assert!(tree.errors().is_empty(), "{:?}", tree.errors());
    assert_eq!((tree.status() as u8, world.started), (1, 4));
    (tree, world)
}

/// Raises a flag. Returns the time until the action that responds to it was started.
pub fn react(tree: &mut Tree<World>, world: &mut World, flag: usize) -> Duration {
    world.raise = Some(flag);
    tree.tick_once(Duration::ZERO, world);
    let reaction = world.reaction.take().expect("the action was started in the same tick");
    tree.halt(Duration::ZERO, world);
    tree.tick_once(Duration::ZERO, world);
    tree.tick_once(Duration::ZERO, world);
    reaction
}
