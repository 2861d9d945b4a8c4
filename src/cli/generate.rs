//! `alhazen generate`: test meshes of any size.

use super::args::GenerateArgs;
use super::progress::{Progress, catch_interrupts, interrupted};
use super::units::grouped;
use super::{Failure, Outcome, prepare, print};
use crate::geometry::generate::GeneratedMesh;
use crate::io::{WriteError, check_writable, write_mesh};

/// Writes the mesh that the flags describe.
pub(super) fn generate(args: &GenerateArgs) -> Result<Outcome, Failure> {
    let bad = |message: String| Failure::BadInput(message);
    let extension = args.output.extension().unwrap_or_default().to_ascii_lowercase();
    if extension != "ply" && extension != "stl" {
        let path = args.output.display();
        return Err(bad(format!("{path}: unknown kind of mesh; accepted: .ply, .stl")));
    }
    let mesh = GeneratedMesh::new(args.kind, args.triangles, args.seed)
        .map_err(|e| bad(format!("--triangles: {e}")))?;
    check_writable(&args.output).map_err(|e| bad(e.to_string()))?;
    catch_interrupts();
    let progress = Progress::new(args.quiet, "generate");
    let go_on = |done| {
        progress.report(done, 0);
        !interrupted()
    };
    let written =
        prepare::thread_pool(args.threads)?.install(|| write_mesh(&args.output, &mesh, &go_on));
    progress.finish();
    written.map_err(|e| match e {
        WriteError::Interrupted => Failure::Interrupted,
        e => Failure::Failed(e.to_string()),
    })?;
    if !args.quiet {
        print(&format!(
            "{}: {} triangles, {} vertices",
            args.output.display(),
            grouped(mesh.triangle_count()),
            grouped(mesh.vertex_count())
        ));
    }
    Ok(Outcome::Done)
}
