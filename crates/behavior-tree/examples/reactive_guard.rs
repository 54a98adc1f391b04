//! A guard that is asked at every tick: when the battery runs low, the flight is halted and the landing begins.
//!
//! `cargo run -p behavior-tree --example reactive_guard`

use std::time::Duration;

use behavior_tree::{Leaf, LeafResult, Library, Port, Ports, Registry, Status};

const TREES: &str = r#"
<root BTCPP_format="4">
  <BehaviorTree ID="Flight">
    <ReactiveFallback>
      <ReactiveSequence>
        <BatteryAbove percent="25"/>
        <Do what="fly" seconds="60"/>
      </ReactiveSequence>
      <Do what="land" seconds="2"/>
    </ReactiveFallback>
  </BehaviorTree>
</root>"#;

/// What the leaves look at, and the commands they collect.
struct World {
    battery: f64,
    commands: Vec<String>,
}

/// Commands something and waits for as long as it takes.
struct Do {
    what: String,
    takes: Duration,
    until: Duration,
}

impl Leaf<World> for Do {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        world.commands.push(format!("start to {}", self.what));
        self.until = ports.now() + self.takes;
        self.tick(world, ports)
    }

    fn tick(&mut self, _: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        ports.tick_at(self.until);
        Ok(if ports.now() < self.until { Status::Running } else { Status::Success })
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        world.commands.push(format!("stop to {}", self.what));
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut registry = Registry::new();
    registry.condition("BatteryAbove", [Port::input::<f64>("percent")], |world: &mut World, ports| {
        let limit = ports.get::<f64>("percent")?;
        ports.because("battery above its limit", world.battery, limit);
        Ok(limit < world.battery)
    });
    registry.action("Do", [Port::input::<String>("what"), Port::input::<u32>("seconds")], |spec| {
        let what = spec.constant::<String>("what")?.unwrap_or_default();
        let takes = Duration::from_secs(spec.constant::<u32>("seconds")?.unwrap_or_default().into());
        Ok(Do { what, takes, until: Duration::ZERO })
    });
    let mut tree = Library::load(&registry, [("flight.xml", TREES)])?.instantiate("Flight", &[])?;

    let mut world = World { battery: 28.0, commands: Vec::new() };
    for second in 0.. {
        let answer = tree.tick_once(Duration::from_secs(second), &mut world);
        let commands = std::mem::take(&mut world.commands).join(", ");
        println!("{second} s, battery {} %: {answer}; {commands}", world.battery);
        if answer.is_completed() {
            break;
        }
        world.battery -= 1.0;
    }
    let guard = tree.find("BatteryAbove").and_then(|node| tree.why(node));
    if let Some(record) = guard {
        println!("the guard failed at {:?}: {}", record.at, record.cause);
    }
    Ok(())
}
