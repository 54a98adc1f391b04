//! `SubTree`: connecting the keys inside to those outside.

use std::time::Duration;

use behavior_tree::{InstantiateError, Library, Port, Registry, Status, Tree, Value};

/// `Put` writes `value` to `key`; `Say` notes the number it reads.
fn registry() -> Registry<Vec<String>> {
    let mut registry = Registry::new();
    registry.sync_action("Put", [Port::input::<i64>("value"), Port::output::<i64>("key")], |_, ports| {
        let value = ports.get::<i64>("value")?;
        ports.set("key", value)?;
        Ok(true)
    });
    registry.sync_action("Say", [Port::input::<i64>("number")], |said: &mut Vec<String>, ports| {
        said.push(ports.get::<i64>("number")?.to_string());
        Ok(true)
    });
    registry
}

fn load(main: &str, others: &str) -> Result<Library<Vec<String>>, String> {
    let xml = crate::stories::support::file(main, others);
    Library::load(&registry(), [("test.xml", xml)]).map_err(|errors| errors.to_string())
}

#[track_caller]
fn check(main: &str, others: &str, expected: &[&str]) -> Tree<Vec<String>> {
    let library = load(main, others).unwrap_or_else(|errors| panic!("{errors}"));
    let mut tree = library.instantiate("m", &[]).expect("no parameters");
    let mut said = Vec::new();
    assert_eq!(tree.tick_once(Duration::ZERO, &mut said), Status::Success, "{:?}", tree.errors());
    assert_eq!(said, expected);
    tree
}

const SAY_X: &str = r#"<BehaviorTree ID="Inner"><Say number="{x}"/></BehaviorTree>"#;

#[test]
fn a_key_inside_is_connected_to_one_outside() {
    let main = |attributes: &str| {
        format!(
            r#"<Sequence><Put value="5" key="{{x}}"/><Put value="7" key="{{y}}"/><SubTree ID="Inner" {attributes}/></Sequence>"#
        )
    };
    check(&main(r#"x="{y}""#), SAY_X, &["7"]);
    check(&main(r#"x="{=}""#), SAY_X, &["5"]);
    check(&main(r#"x="12""#), SAY_X, &["12"]);
    check(&main(r#"_autoremap="true""#), SAY_X, &["5"]);
    let own =
        r#"<BehaviorTree ID="Inner"><Sequence><Put value="9" key="{x}"/><Say number="{x}"/></Sequence></BehaviorTree>"#;
    check(&main(""), own, &["9"]);
}

#[test]
fn what_is_written_inside_is_read_outside() {
    let main = r#"<Sequence><SubTree ID="Inner" x="{result}"/><Say number="{result}"/></Sequence>"#;
    check(main, r#"<BehaviorTree ID="Inner"><Put value="3" key="{x}"/></BehaviorTree>"#, &["3"]);
}

#[test]
fn connections_go_through_several_levels() {
    let main = r#"<Sequence><Put value="4" key="{a}"/><SubTree ID="Middle" b="{a}"/></Sequence>"#;
    let others = format!(r#"{SAY_X}<BehaviorTree ID="Middle"><SubTree ID="Inner" x="{{b}}"/></BehaviorTree>"#);
    check(main, &others, &["4"]);
}

#[test]
fn an_at_sign_means_the_outermost_tree() {
    let main = r#"<Sequence><Put value="4" key="{a}"/><SubTree ID="Inner"/></Sequence>"#;
    check(
        main,
        r#"<BehaviorTree ID="Inner"><Sequence><Say number="{@a}"/><Script code="@a += 1"/><Say number="{@a}"/></Sequence></BehaviorTree>"#,
        &["4", "5"],
    );
}

#[test]
fn private_keys_are_not_remapped_automatically() {
    let main = r#"<Sequence><Put value="4" key="{_x}"/><SubTree ID="Inner" _autoremap="true"/></Sequence>"#;
    let inner = r#"<BehaviorTree ID="Inner"><Sequence><Put value="5" key="{_x}"/><Say number="{_x}"/></Sequence></BehaviorTree>"#;
    let tree = check(main, inner, &["5"]);
    assert_eq!(tree.get::<i64>("_x"), Some(4));
    assert_eq!(tree.get::<i64>("Inner::3/_x"), Some(5));
}

#[test]
fn every_included_tree_has_its_own_keys() {
    let main = r#"<Sequence><SubTree ID="Inner" name="a" x="1"/><SubTree ID="Inner" name="b" x="2"/></Sequence>"#;
    let tree = check(main, SAY_X, &["1", "2"]);
    assert_eq!((tree.get::<i64>("a/x"), tree.get::<i64>("b/x")), (Some(1), Some(2)));
}

#[test]
fn a_model_gives_defaults_and_requires_the_rest() {
    let model = |port: &str| {
        format!(
            r#"{SAY_X}<TreeNodesModel><SubTree ID="Inner"><input_port name="x" {port}/></SubTree></TreeNodesModel>"#
        )
    };
    check(r#"<SubTree ID="Inner"/>"#, &model(r#"default="8""#), &["8"]);
    let errors = load(r#"<SubTree ID="Inner"/>"#, &model("")).err().expect("a mistake");
    assert_eq!(errors, "test.xml:1:70: `Inner` needs a value for its input port `x` of type any");
}

#[test]
fn an_instance_is_given_its_parameters() {
    let others = r#"<BehaviorTree ID="Step"><Say number="{n}"/></BehaviorTree>
        <TreeNodesModel><SubTree ID="Step"><input_port name="n" type="int"/></SubTree></TreeNodesModel>"#;
    let library = load("<AlwaysSuccess/>", others).unwrap_or_else(|errors| panic!("{errors}"));
    let mut said = Vec::new();
    for number in [1, 2] {
        let mut step = library.instantiate("Step", &[("n", Value::from(number))]).expect("it fits");
        step.tick_once(Duration::ZERO, &mut said);
    }
    assert_eq!(said, ["1", "2"]);

    let refusal = |parameters: &[(&str, Value)]| {
        let error: InstantiateError = library.instantiate("Step", parameters).err().expect("a refusal");
        let source = std::error::Error::source(&error).map(|it| format!(": {it}")).unwrap_or_default();
        format!("{error}{source}")
    };
    assert_eq!(refusal(&[]), "tree `Step` needs a value for its parameter `n`");
    let wrong_type = "a parameter cannot be set: key `n`: expected int, found `one`";
    assert_eq!(refusal(&[("n", "one".into())]), wrong_type);
    let unknown = "a parameter cannot be set: tree `Step` has no parameter or global `m`";
    assert_eq!(refusal(&[("m", 1.into())]), unknown);
    let error = library.instantiate("Stop", &[]).err().expect("a refusal");
    assert_eq!(error.to_string(), "there is no tree `Stop`; did you mean `Step`?");
}
