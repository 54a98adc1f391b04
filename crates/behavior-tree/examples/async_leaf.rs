//! A leaf whose work an async task does. Nothing polls: the task wakes the tree when it has a result.
//!
//! `cargo run -p behavior-tree --example async_leaf`

#![expect(clippy::disallowed_methods, reason = "it plays a service that takes some time")]

use std::time::Duration;

use behavior_tree::{Leaf, LeafResult, Library, NextTick, Port, Ports, Registry, Status, WakeSignal};
use tokio::sync::oneshot;

const TREES: &str = r#"
<root BTCPP_format="4">
  <BehaviorTree ID="Main">
    <Sequence>
      <Plan task="to the turbine"/>
      <Timeout msec="20"><Plan task="round the world"/></Timeout>
    </Sequence>
  </BehaviorTree>
</root>"#;

/// Asks a planner, which needs some time.
struct Plan {
    task: String,
    plan: Option<oneshot::Receiver<String>>,
}

impl Leaf<()> for Plan {
    fn start(&mut self, _: &mut (), ports: &mut Ports<'_>) -> LeafResult {
        let (sender, receiver) = oneshot::channel();
        self.plan = Some(receiver);
        let (task, waker) = (self.task.clone(), ports.waker().clone());
        tokio::spawn(async move {
            tokio::time::sleep(Duration::from_millis(3 * task.len() as u64)).await;
            // Sending fails if the leaf was halted meanwhile: it no longer waits for the plan.
            if sender.send(format!("a plan {task}")).is_ok() {
                waker.wake();
            }
        });
        Ok(Status::Running)
    }

    fn tick(&mut self, _: &mut (), _: &mut Ports<'_>) -> LeafResult {
        let receiver = self.plan.as_mut().ok_or("not started")?;
        match receiver.try_recv() {
            Ok(plan) => {
                println!("got {plan}");
                Ok(Status::Success)
            }
            Err(oneshot::error::TryRecvError::Empty) => Ok(Status::Running),
            Err(error) => Err(error.into()),
        }
    }

    fn halt(&mut self, _: &mut (), _: &mut Ports<'_>) {
        println!("no plan {} in time", self.task);
        self.plan = None;
    }
}

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut registry = Registry::new();
    registry.action("Plan", [Port::input::<String>("task")], |spec| {
        Ok(Plan { task: spec.constant("task")?.unwrap_or_default(), plan: None })
    });
    let mut tree = Library::load(&registry, [("main.xml", TREES)])?.instantiate("Main", &[])?;

    let signal = WakeSignal::new();
    tree.set_waker(signal.waker());
    let start = tokio::time::Instant::now();
    loop {
        let status = tree.tick_once(start.elapsed(), &mut ());
        println!("{:>3} ms: {status}", start.elapsed().as_millis());
        if status.is_completed() {
            return Ok(());
        }
        match tree.next_tick() {
            NextTick::AtOnce => {}
            NextTick::WhenWoken => signal.woken().await,
            NextTick::At(time) => tokio::select! {
                () = signal.woken() => {}
                () = tokio::time::sleep_until(start + time) => {}
            },
        }
    }
}
