//! What the conformance traces do not cover in decorators.

use crate::stories::support::check;

#[test]
fn decorators_pass_skipped_on() {
    for tag in ["Inverter", "ForceSuccess", "ForceFailure", "SuccessIsRunning", "RunOnce"] {
        check(&format!(r#"<{tag}><L id="1" s="K"/></{tag}>"#), "t", "s1 K[RI]");
    }
    check(r#"<KeepRunningUntilFailure><L id="1" s="K"/></KeepRunningUntilFailure>"#, "t", "s1 R[RI]");
    let repeat = r#"<Repeat num_cycles="2"><L id="1" s="SKS"/></Repeat>"#;
    check(repeat, "ttt", "s1 R[RI], s1 K[RI], s1 S[II]");
    let retry = r#"<RetryUntilSuccessful num_attempts="2"><L id="1" s="FKF"/></RetryUntilSuccessful>"#;
    check(retry, "ttt", "s1 R[RI], s1 K[RI], s1 F[II]");
}

#[test]
fn success_is_running_ticks_its_child_until_it_succeeds_and_then_never_again() {
    let root = r#"<SuccessIsRunning><L id="1" s="RSF"/></SuccessIsRunning>"#;
    check(root, "tttht", "s1 R[RR], r1 R[RI], R[RI], H[II], s1 F[II]");
    check(r#"<SuccessIsRunning><L id="1" s="RF"/></SuccessIsRunning>"#, "tt", "s1 R[RR], r1 F[II]");
}

#[test]
fn success_is_running_lets_the_work_beside_it_finish() {
    let root = r#"<Parallel success_count="1" failure_count="1">
        <SuccessIsRunning><L id="1" s="S"/></SuccessIsRunning><L id="2" s="RRS"/></Parallel>"#;
    check(root, "tttt", "s1s2 R[RRIR], r2 R[RRIR], r2 S[IIII], s1s2 R[RRIR]");
}

#[test]
fn run_once_skips_or_repeats_the_status_afterwards() {
    check(r#"<RunOnce><L id="1" s="RS"/></RunOnce>"#, "ttht", "s1 R[RR], r1 S[II], H[II], K[II]");
    check(r#"<RunOnce then_skip="false"><L id="1" s="F"/></RunOnce>"#, "tt", "s1 F[II], F[II]");
}

#[test]
fn loops_pause_between_two_rounds() {
    check(r#"<Repeat num_cycles="3"><L id="1" s="S"/></Repeat>"#, "ttt", "s1 R[RI], s1 R[RI], s1 S[II]");
    check(r#"<Repeat num_cycles="3"><L id="1" s="S"/></Repeat>"#, "o", "s1s1s1 S[II]");
    check(r#"<Repeat num_cycles="0"><L id="1" s="S"/></Repeat>"#, "t", "S[II]");
    let retry = r#"<RetryUntilSuccessful num_attempts="2"><L id="1" s="F"/></RetryUntilSuccessful>"#;
    check(retry, "o", "s1s1 F[II]");
    check(r#"<RetryUntilSuccessful num_attempts="0"><L id="1" s="F"/></RetryUntilSuccessful>"#, "t", "F[II]");
}

#[test]
fn an_endless_loop_does_not_hang_its_caller() {
    let root = r#"<Repeat num_cycles="-1"><L id="" s="S"/></Repeat>"#;
    let hundred = "s".repeat(behavior_tree::MAX_TICKS_AT_ONCE);
    check(root, "o", &format!("{hundred} R[RI]"));
}

#[test]
fn a_retry_limit_in_a_key_is_read_again_after_every_attempt() {
    let root = r#"<Sequence><Script code="n := 5"/>
        <RetryUntilSuccessful num_attempts="{n}"><L id="1" s="F" _onFailure="n := 2"/></RetryUntilSuccessful></Sequence>"#;
    check(root, "o", "s1s1 F[IIII]");
}
