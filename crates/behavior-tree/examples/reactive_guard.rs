//! A guard that is ticked at every tick: when the battery is low, the flight is halted and the landing starts.
//!
//! `cargo run -p behavior-tree --example reactive_guard`, or with `-- flight.btlog` at the end for a log that Groot2
//! replays.

use std::fs::File;
use std::io::{self, Write};
use std::time::{Duration, UNIX_EPOCH};

use behavior_tree::{BtlogWriter, Leaf, LeafResult, Library, Port, Ports, Registry, Status};

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

/// What the leaves read, and the commands that they collect.
struct World {
    battery: f64,
    commands: Vec<String>,
}

/// Commands something and waits until it is done.
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
    registry.condition("BatteryAbove", [Port::input::<f64>("percent")], |world: &World, ports| {
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

    let log: Box<dyn Write> = match std::env::args_os().nth(1) {
        Some(path) => Box::new(File::create(path)?),
        None => Box::new(io::sink()),
    };
    tree.record_changes(1000, || 0);
    let mut log = BtlogWriter::new(log, &tree, UNIX_EPOCH.elapsed()?, Duration::ZERO)?;

    let mut world = World { battery: 28.0, commands: Vec::new() };
    for second in 0.. {
        let status = tree.tick_once(Duration::from_secs(second), &mut world);
        log.write_changes(&mut tree)?;
        let commands = std::mem::take(&mut world.commands).join(", ");
        println!("{second} s, battery {} %: {status}; {commands}", world.battery);
        if status.is_completed() {
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
