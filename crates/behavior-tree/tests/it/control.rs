//! What the conformance traces do not cover in control nodes: skipping, the asynchronous nodes, `Switch`.

use crate::stories::support::check;

#[test]
fn a_sequence_passes_over_skipped_children_and_is_skipped_if_all_are() {
    check(r#"<Sequence><L id="1" s="K"/><L id="2" s="S"/></Sequence>"#, "t", "s1s2 S[III]");
    check(r#"<Sequence><L id="1" s="K"/><L id="2" s="F"/></Sequence>"#, "t", "s1s2 F[III]");
    check(r#"<Sequence><L id="1" s="K"/><L id="2" s="K"/></Sequence>"#, "tt", "s1s2 K[RII], s1s2 K[RII]");
    check(r#"<Sequence><L id="1" s="K"/><L id="2" s="RK"/></Sequence>"#, "tt", "s1s2 R[RIR], r2h2 K[RII]");
}

#[test]
fn a_fallback_passes_over_skipped_children_and_is_skipped_if_all_are() {
    check(r#"<Fallback><L id="1" s="K"/><L id="2" s="F"/></Fallback>"#, "t", "s1s2 F[III]");
    check(r#"<Fallback><L id="1" s="K"/><L id="2" s="K"/></Fallback>"#, "t", "s1s2 K[RII]");
}

#[test]
fn a_sequence_with_memory_continues_after_failure_and_halt() {
    let root = r#"<SequenceWithMemory><L id="1" s="S"/><L id="2" s="FRS"/></SequenceWithMemory>"#;
    check(root, "ttthttt", "s1 R[RSI], s2 F[ISI], s2 R[RSR], h2 H[III], s2 S[III], s1 R[RSI], s2 F[ISI]");
    check(r#"<SequenceWithMemory><L id="1" s="K"/><L id="2" s="K"/></SequenceWithMemory>"#, "t", "s1s2 K[RII]");
}

#[test]
fn asynchronous_nodes_pause_between_children() {
    let sequence = r#"<AsyncSequence><L id="1" s="S"/><L id="2" s="S"/></AsyncSequence>"#;
    check(sequence, "tt", "s1 R[RSI], s2 S[III]");
    check(sequence, "o", "s1s2 S[III]");
    let fallback = r#"<AsyncFallback><L id="1" s="F"/><L id="2" s="RF"/></AsyncFallback>"#;
    check(fallback, "ttt", "s1 R[RFI], s2 R[RFR], r2 F[III]");
    check(fallback, "o", "s1s2 R[RFR]");
}

#[test]
fn reactive_nodes_tick_all_children_again_and_reset_skipped_ones() {
    let sequence = r#"<ReactiveSequence><C id="1" s="SKF"/><L id="2" s="R"/></ReactiveSequence>"#;
    check(sequence, "ttt", "s1s2 R[RIR], s1r2 R[RIR], s1h2 F[III]");
    let fallback = r#"<ReactiveFallback><C id="1" s="FKS"/><L id="2" s="R"/></ReactiveFallback>"#;
    check(fallback, "ttt", "s1s2 R[RIR], s1r2 R[RIR], s1h2 S[III]");
    check(r#"<ReactiveSequence><L id="1" s="K"/></ReactiveSequence>"#, "t", "s1 K[RI]");
}

#[test]
fn a_reactive_node_starts_the_new_child_before_it_halts_the_old_one() {
    let root = r#"<ReactiveFallback><L id="1" s="FR"/><L id="2" s="R"/></ReactiveFallback>"#;
    check(root, "tt", "s1s2 R[RIR], s1h2 R[RRI]");
}

#[test]
fn a_parallel_counts_skipped_children_only_if_it_wants_all() {
    let all = r#"<Parallel><L id="1" s="K"/><L id="2" s="S"/></Parallel>"#;
    check(all, "t", "s1s2 S[III]");
    let two = r#"<Parallel success_count="2"><L id="1" s="K"/><L id="2" s="S"/></Parallel>"#;
    check(two, "tt", "s1s2 R[RIS], s1 R[RIS]");
    check(r#"<Parallel><L id="1" s="K"/><L id="2" s="K"/></Parallel>"#, "t", "s1s2 S[III]");
    let one = r#"<Parallel success_count="1"><L id="1" s="K"/><L id="2" s="K"/></Parallel>"#;
    check(one, "t", "s1s2 K[RII]");
}

#[test]
fn a_parallel_takes_its_counts_from_keys() {
    let root = r#"<Sequence><Script code="n := 1"/><Parallel success_count="{n}"><L id="1" s="R"/><L id="2" s="S"/></Parallel></Sequence>"#;
    check(root, "t", "s1s2h1 S[IIIII]");
}

#[test]
fn a_parallel_all_waits_for_every_child() {
    let root = r#"<ParallelAll><L id="1" s="F"/><L id="2" s="RS"/></ParallelAll>"#;
    check(root, "tt", "s1s2 R[RFR], r2 F[III]");
    let two = r#"<ParallelAll max_failures="2"><L id="1" s="F"/><L id="2" s="S"/></ParallelAll>"#;
    check(two, "t", "s1s2 S[III]");
    let all = r#"<ParallelAll max_failures="-1"><L id="1" s="F"/><L id="2" s="F"/></ParallelAll>"#;
    check(all, "t", "s1s2 F[III]");
    check(r#"<ParallelAll><L id="1" s="K"/><L id="2" s="K"/></ParallelAll>"#, "t", "s1s2 K[RII]");
    check(r#"<ParallelAll><L id="1" s="RK"/><L id="2" s="S"/></ParallelAll>"#, "tt", "s1s2 R[RRS], r1h1 S[III]");
}

#[test]
fn a_skipped_condition_skips_if_then_else_and_while_do_else() {
    check(r#"<IfThenElse><L id="1" s="K"/><L id="2" s="S"/></IfThenElse>"#, "t", "s1 K[RII]");
    check(r#"<WhileDoElse><L id="1" s="K"/><L id="2" s="S"/></WhileDoElse>"#, "t", "s1 K[RII]");
}

#[test]
fn while_do_else_halts_the_branch_before_it_starts_the_other() {
    let root = r#"<WhileDoElse><C id="1" s="SF"/><L id="2" s="R"/><L id="3" s="R"/></WhileDoElse>"#;
    check(root, "ttt", "s1s2 R[RSRI], s1h2s3 R[RFIR], s1h3s2 R[RSRI]");
}

#[test]
fn a_switch_runs_the_child_of_the_matching_case() {
    let root = |before: &str, variable: &str| {
        format!(
            r#"<Sequence><Script code="{before}"/><Switch2 variable="{variable}" case_1="1" case_2="two">
            <L id="1" s="S"/><L id="2" s="S"/><L id="3" s="S"/></Switch2></Sequence>"#
        )
    };
    check(&root("v := 1", "{v}"), "t", "s1 S[IIIIII]");
    check(&root("v := 1.0", "{v}"), "t", "s1 S[IIIIII]");
    check(&root("v := 'two'", "{v}"), "t", "s2 S[IIIIII]");
    check(&root("v := 7", "{v}"), "t", "s3 S[IIIIII]");
    check(&root("true", "two"), "t", "s2 S[IIIIII]");
}

#[test]
fn a_switch_halts_the_running_child_when_the_case_changes() {
    let root = r#"<Parallel><L id="0" s="R" _onSuccess="v := 0"/>
        <Switch2 variable="{v}" case_1="1" case_2="2"><L id="1" s="R"/><L id="2" s="R"/><L id="3" s="R"/></Switch2>
        <Sequence><L id="4" s="RS"/><Script code="v := 2"/><L id="5" s="R"/></Sequence></Parallel>"#;
    let without_variable = "s0s3s4 R[RRRIIRRRII], r0r3r4s5 R[RRRIIRRSSR], r0h3s2r5 R[RRRIRIRSSR]";
    check(root, "ttt", without_variable);
}

#[test]
fn a_tree_may_be_as_deep_as_loading_allows() {
    let depth = 250;
    let root = "<Inverter>".repeat(depth) + r#"<L id="1" s="RS"/>"# + &"</Inverter>".repeat(depth);
    let (running, idle) = ("R".repeat(depth + 1), "I".repeat(depth + 1));
    check(&root, "tth", &format!("s1 R[{running}], r1 S[{idle}], H[{idle}]"));
}
