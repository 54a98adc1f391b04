//! Compiles the contract with protox, so that no `protoc` is needed on the machine.

use prost::Message;
use std::path::PathBuf;

const FILES: [&str; 12] = [
    "kittiwake/v1/fmu.proto",
    "kittiwake/v1/health.proto",
    "kittiwake/v1/introspection.proto",
    "kittiwake/v1/mcm.proto",
    "kittiwake/v1/operator.proto",
    "kittiwake/v1/permission.proto",
    "kittiwake/v1/planner.proto",
    "kittiwake/v1/sim.proto",
    "kittiwake/v1/site.proto",
    "kittiwake/v1/skill.proto",
    "kittiwake/v1/timing.proto",
    "kittiwake/v1/view.proto",
];

/// They may be megabytes, and are handed on as they are.
const AREAS: [&str; 3] =
    [".kittiwake.v1.PlanningBasis.areas", ".kittiwake.v1.EditReply.areas", ".kittiwake.v1.StoredMission.areas"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo:rerun-if-changed=kittiwake");
    let descriptors = protox::compile(FILES, ["."])?;
    let out = PathBuf::from(std::env::var("OUT_DIR")?);
    std::fs::write(out.join("descriptor.bin"), descriptors.encode_to_vec())?;
    prost_build::Config::new().enable_type_names().bytes(AREAS).compile_fds(descriptors)?;
    Ok(())
}
