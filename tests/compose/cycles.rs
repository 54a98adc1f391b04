//! Up and down again, several times.

use std::net::TcpListener;

use crate::compose::support::Project;

#[test]
#[ignore = "needs an image: KITTIWAKE_IMAGE=NAME cargo test --test stories -- --ignored compose::"]
fn ten_times_up_and_down_leave_nothing_behind() {
    let project = Project::new("cycles");
    for cycle in 1..=10 {
        project.up();
        let processes = project.processes();
        assert!(9 <= processes.len(), "cycle {cycle}: {processes:?}");
        assert_eq!(project.down(), Vec::<String>::new(), "left behind by cycle {cycle}");
        let left: Vec<_> = processes.iter().filter(|(_, it)| it.exists()).collect();
        assert!(left.is_empty(), "cycle {cycle}: {left:?} still run");
        TcpListener::bind(("127.0.0.1", project.port)).expect("the port is free again");
    }
}
