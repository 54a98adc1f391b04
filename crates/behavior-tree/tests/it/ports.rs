//! Typed ports and keys.

use std::time::Duration;

use behavior_tree::{
    BuildError, In, Leaf, LeafResult, Library, NodeSpec, Object, Out, Port, Ports, Registry, SetError, Status, Value,
};

use crate::stories::support::file;

#[derive(Clone, Debug, PartialEq)]
struct Waypoint {
    north: f64,
    east: f64,
}

impl Object for Waypoint {
    const NAME: &'static str = "Waypoint";

    fn parse(text: &str) -> Option<Self> {
        let (north, east) = text.split_once(';')?;
        Some(Waypoint { north: north.parse().ok()?, east: east.parse().ok()? })
    }
}

/// Adds `by` to the north of `from` and writes it to `to`.
struct Shift {
    from: In<Waypoint>,
    by: In<f64>,
    to: Out<Waypoint>,
}

impl Shift {
    fn build(spec: &NodeSpec<'_>) -> Result<Self, BuildError> {
        Ok(Shift { from: spec.input("from")?, by: spec.input("by")?, to: spec.output("to")? })
    }
}

impl Leaf<()> for Shift {
    fn tick(&mut self, _: &mut (), ports: &mut Ports<'_>) -> LeafResult {
        let mut waypoint = ports.read(self.from)?;
        waypoint.north += ports.read(self.by)?;
        ports.write(self.to, waypoint);
        Ok(Status::Success)
    }
}

fn registry() -> Registry<()> {
    let mut registry = Registry::new();
    let ports =
        [Port::input::<Waypoint>("from"), Port::input::<f64>("by").default("1.5"), Port::output::<Waypoint>("to")];
    registry.action("Shift", ports, Shift::build);
    registry.global::<f64>("wind");
    registry
}

fn load(root: &str) -> Result<Library<()>, String> {
    Library::load(&registry(), [("test.xml", file(root, ""))]).map_err(|errors| errors.to_string())
}

#[test]
fn values_travel_through_ports_with_their_types() {
    let root =
        r#"<Sequence><Shift from="1;2" to="{a}"/><Shift from="{a}" by="10" to="{b}"/><Shift from="{b}"/></Sequence>"#;
    let mut tree = load(root).unwrap_or_else(|errors| panic!("{errors}")).instantiate("m", &[]).expect("no parameters");
    assert_eq!(tree.tick_once(Duration::ZERO, &mut ()), Status::Success);
    assert_eq!(tree.get::<Waypoint>("b"), Some(Waypoint { north: 12.5, east: 2.0 }));
    assert_eq!(tree.get::<f64>("b"), None);
}

#[test]
fn a_key_that_is_read_too_early_fails_the_node() {
    let root = r#"<Sequence><Shift from="{later}"/><Shift from="0;0" to="{later}"/></Sequence>"#;
    let mut tree = load(root).unwrap_or_else(|errors| panic!("{errors}")).instantiate("m", &[]).expect("no parameters");
    assert_eq!(tree.tick_once(Duration::ZERO, &mut ()), Status::Failure);
    let message = "port `from`: key `later` has no value yet";
    assert_eq!(tree.errors()[0].kind.to_string(), message);
}

#[test]
fn a_global_is_set_from_outside_and_read_inside() {
    let root = r#"<ScriptCondition code="wind &lt; 8"/>"#;
    let mut tree = load(root).unwrap_or_else(|errors| panic!("{errors}")).instantiate("m", &[]).expect("no parameters");
    tree.set("wind", 5.0).expect("a global");
    assert_eq!(tree.tick_once(Duration::ZERO, &mut ()), Status::Success);
    tree.set("wind", 9.0).expect("a global");
    assert_eq!(tree.tick_once(Duration::ZERO, &mut ()), Status::Failure);
    assert!(matches!(tree.set("wind", "strong"), Err(SetError::WrongType { .. })));
    assert!(matches!(tree.set("wnid", 5.0), Err(SetError::NoSuchKey { .. })));
}

#[test]
fn a_factory_that_contradicts_its_declaration_is_found_when_loading() {
    let mut registry = Registry::new();
    registry.action("Shift", [Port::input::<f64>("from")], Shift::build);
    let errors =
        Library::<()>::load(&registry, [("test.xml", file(r#"<Shift from="1"/>"#, ""))]).err().expect("a mistake");
    let expected = "`Shift` declares port `from` as double and uses it as Waypoint";
    assert!(errors.to_string().contains(expected), "{errors}");
}

#[test]
fn a_constant_that_is_too_large_for_its_port_is_found_when_loading() {
    let mut registry = Registry::<()>::new();
    registry.condition("Small", [Port::input::<u8>("n")], |_, _| Ok(true));
    let load = |text: &str| Library::load(&registry, [("test.xml", file(&format!("<Small n=\"{text}\"/>"), ""))]);
    assert!(load("255").is_ok());
    let errors = load("256").err().expect("a mistake").to_string();
    assert!(errors.contains("port `n`: expected int in the port's range, found \"256\""), "{errors}");
}

#[test]
fn constants_take_the_type_of_their_port() {
    #[track_caller]
    fn check<T: behavior_tree::PortValue + PartialEq + std::fmt::Debug>(text: &str, expected: Option<T>) {
        let found = T::port_type().parse(text).as_ref().and_then(T::from_value);
        assert_eq!(found, expected, "{text}");
    }
    check("1", Some(1));
    check(" 1 ", Some(1));
    check::<i64>("1.5", None);
    check("1", Some(1.0));
    check("inf", Some(f64::INFINITY));
    check::<f64>("nan", None);
    check("true", Some(true));
    check("1", Some(true));
    check::<bool>("yes", None);
    check(" a ", Some(" a ".to_owned()));
    check::<u8>("256", None);
    check("2.5", Some(Value::Float(2.5)));
    check("inf", Some(Value::from("inf")));
    check("false", Some(Value::Bool(false)));
}
