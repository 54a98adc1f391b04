//! A tree with an action, ticked until it has finished.
//!
//! `cargo run -p behavior-tree --example hello_tree`

use std::time::Duration;

use behavior_tree::{BuildError, In, Leaf, LeafResult, Library, NodeSpec, Port, Ports, Registry, Status};

const TREES: &str = r#"
<root BTCPP_format="4" main_tree_to_execute="Hello">
  <BehaviorTree ID="Hello">
    <Sequence>
      <Script code="guest := 'tree'"/>
      <Say text="hello" times="1"/>
      <SubTree ID="Greet" who="{guest}"/>
    </Sequence>
  </BehaviorTree>
  <BehaviorTree ID="Greet">
    <Say text="{who}" times="3"/>
  </BehaviorTree>
</root>"#;

/// Says a text at every tick, as often as its port `times` says.
struct Say {
    text: In<String>,
    times: In<u32>,
    said: u32,
}

impl Say {
    fn build(spec: &NodeSpec<'_>) -> Result<Self, BuildError> {
        Ok(Say { text: spec.input("text")?, times: spec.input("times")?, said: 0 })
    }
}

impl Leaf<Vec<String>> for Say {
    fn start(&mut self, spoken: &mut Vec<String>, ports: &mut Ports<'_>) -> LeafResult {
        self.said = 0;
        self.tick(spoken, ports)
    }

    fn tick(&mut self, spoken: &mut Vec<String>, ports: &mut Ports<'_>) -> LeafResult {
        spoken.push(ports.read(self.text)?);
        self.said += 1;
        Ok(if self.said < ports.read(self.times)? { Status::Running } else { Status::Success })
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut registry = Registry::new();
    registry.action("Say", [Port::input::<String>("text"), Port::input::<u32>("times")], Say::build);
    let library = Library::load(&registry, [("hello.xml", TREES)])?;
    let mut tree = library.instantiate("Hello", &[])?;

    let mut spoken = Vec::new();
    for second in 0.. {
        let status = tree.tick_once(Duration::from_secs(second), &mut spoken);
        println!("after {second} s: {status}, said {}", spoken.join(", "));
        print!("{}", tree.to_text());
        if status.is_completed() {
            break;
        }
    }
    Ok(())
}
