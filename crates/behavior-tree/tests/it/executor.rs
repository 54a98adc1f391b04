//! A leaf that builds a tree from a template at run time and passes its ticks and halts to it.

use std::time::Duration;

use behavior_tree::{
    BuildError, Leaf, LeafResult, Library, NodeSpec, NodeStatus, Object, Port, PortValue, Ports, Registry, Status,
    Template, Tree,
};

#[derive(Clone, Debug)]
struct Goal {
    north: f64,
}

impl Object for Goal {
    const NAME: &'static str = "Goal";
}

/// The inputs of the leaves, and what is sent after the tick.
#[derive(Default)]
struct World {
    next_goal: Option<Goal>,
    steps: Option<Template<World>>,
    arrived: bool,
    sent: Vec<String>,
}

struct Fly {
    goal: behavior_tree::In<Goal>,
}

impl Fly {
    fn build(spec: &NodeSpec<'_>) -> Result<Self, BuildError> {
        Ok(Fly { goal: spec.input("goal")? })
    }
}

impl Leaf<World> for Fly {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let goal = ports.read(self.goal)?;
        world.sent.push(format!("fly to {}", goal.north));
        Ok(Status::Running)
    }

    fn tick(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        Ok(if world.arrived { Status::Success } else { Status::Running })
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        world.sent.push("stop".into());
    }
}

/// Builds the step's tree when it is started, and passes its ticks on to the tree.
#[derive(Default)]
struct Executor {
    step: Option<Tree<World>>,
}

impl Leaf<World> for Executor {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let goal = world.next_goal.take().ok_or("there is no next step")?;
        let template = world.steps.clone().ok_or("the trees are not loaded")?;
        self.step = Some(template.instantiate_with(&[("goal", goal.into_value())], ports.waker())?);
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

/// Returns an error for the script `err`, and failure otherwise.
struct Scripted(&'static str);

impl Leaf<World> for Scripted {
    fn tick(&mut self, _: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        match self.0 {
            "err" => Err("no fix".into()),
            _ => {
                ports.because("battery above reserve", 0.5, 0.7);
                Ok(Status::Failure)
            }
        }
    }
}

const TREES: &str = r#"<root BTCPP_format="4" main_tree_to_execute="Main">
  <BehaviorTree ID="Main"><KeepRunningUntilFailure><Executor/></KeepRunningUntilFailure></BehaviorTree>
  <BehaviorTree ID="Step"><Sequence><NoErrors/><Fly goal="{goal}"/></Sequence></BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="Step"><input_port name="goal" type="Goal">where to</input_port></SubTree>
  </TreeNodesModel>
</root>"#;

#[test]
fn an_executor_passes_ticks_and_halts_to_its_step() {
    let mut registry = Registry::new();
    registry.condition("NoErrors", [], |_, _| Ok(true));
    registry.action("Fly", [Port::input::<Goal>("goal")], Fly::build);
    registry.action("Executor", [], |_| Ok(Executor::default()));
    let library = Library::load(&registry, [("trees.xml", TREES)]).unwrap_or_else(|errors| panic!("{errors}"));

    let mut world = World { next_goal: Some(Goal { north: 500.0 }), ..World::default() };
    world.steps = library.template("Step");
    let mut tree = library.instantiate("Main", &[]).expect("no parameters");

    assert_eq!(tree.tick_once(Duration::ZERO, &mut world), Status::Running);
    assert_eq!(world.sent, ["fly to 500"]);
    tree.halt(Duration::from_secs(1), &mut world);
    assert_eq!(world.sent, ["fly to 500", "stop"]);
    assert!(tree.statuses().iter().all(|status| *status == NodeStatus::Idle));

    // Without a next step the executor returns an error: its node fails, and the error is recorded.
    assert_eq!(tree.tick_once(Duration::from_secs(2), &mut world), Status::Failure);
    let (errors, _) = tree.take_errors();
    assert_eq!(errors[0].kind.to_string(), "there is no next step");

    world.next_goal = Some(Goal { north: 0.0 });
    world.arrived = true;
    tree.tick_once(Duration::from_secs(3), &mut world);
    assert_eq!(tree.tick_once(Duration::from_secs(4), &mut world), Status::Running, "kept running by its parent");
}

#[test]
fn failures_and_errors_of_a_step_are_passed_on() {
    for (result, why, errors) in [
        ("fail", "not met: battery above reserve (found 0.5, limit 0.7)", [].as_slice()),
        ("err", "no fix", ["Executor > again/Scripted: no fix"].as_slice()),
    ] {
        let mut registry = Registry::new();
        registry.action("Executor", [], |_| Ok(Executor::default()));
        registry.action("Scripted", [Port::inout::<Goal>("goal")], move |_| Ok(Scripted(result)));
        let trees = r#"<root BTCPP_format="4" main_tree_to_execute="Main">
          <BehaviorTree ID="Main"><Executor/></BehaviorTree>
          <BehaviorTree ID="Step"><SubTree ID="Inner" name="again" goal="{goal}"/></BehaviorTree>
          <BehaviorTree ID="Inner"><Scripted goal="{goal}"/></BehaviorTree>
          <TreeNodesModel><SubTree ID="Step"><input_port name="goal" type="Goal"/></SubTree></TreeNodesModel></root>"#;
        let library = Library::load(&registry, [("trees.xml", trees)]).unwrap_or_else(|errors| panic!("{errors}"));
        let mut world = World { next_goal: Some(Goal { north: 0.0 }), ..World::default() };
        world.steps = library.template("Step");
        let mut tree = library.instantiate("Main", &[]).expect("no parameters");
        assert_eq!(tree.tick_once(Duration::ZERO, &mut world), Status::Failure);
        let failure = tree.last_failure().expect("it failed");
        let reason = failure.why.map(|record| record.cause.to_string());
        assert_eq!((failure.name, reason.as_deref()), ("Executor", Some(why)));
        let found: Vec<_> = tree.errors().iter().map(|error| format!("{}: {}", error.path, error.kind)).collect();
        assert_eq!(found, errors);
    }
}
