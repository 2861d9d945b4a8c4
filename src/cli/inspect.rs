//! `alhazen inspect`: what a scene holds, what it requires, what it costs.

use std::time::Instant;

use super::args::InspectArgs;
use super::report::peak_bytes;
use super::units::{grouped, megabytes};
use super::{Failure, Outcome, prepare, print};
use crate::film::PixelRect;
use crate::scene::{IntegratorKind, Scene};

/// Loads and builds the scene, and prints what it finds.
pub(super) fn inspect(args: &InspectArgs) -> Result<Outcome, Failure> {
    let accel = &args.accel;
    let args = &args.scene;
    super::progress::catch_interrupts();
    let clock = Instant::now();
    let loaded = prepare::load(args)?;
    let read = clock.elapsed().as_secs_f64();
    let hash = loaded.hash;
    let clock = Instant::now();
    let film = prepare::film_bytes(&PixelRect::whole(loaded.scene.image.size), false);
    let pool = prepare::thread_pool(args.threads)?;
    let scene = pool.install(|| prepare::build(args, accel, loaded, film, None))?;
    let build = clock.elapsed().as_secs_f64();

    let info = scene.accel.info();
    print(&args.scene.display().to_string());
    let costs = [
        ("cost", format!("read {read:.3} s, build {build:.3} s")),
        (
            "",
            format!(
                "{} in {info}, {} at most in all",
                megabytes(info.bytes),
                megabytes(peak_bytes())
            ),
        ),
        (
            "estimate",
            format!(
                "{} while it is built, {} after{}, quality {}; picture {}",
                megabytes(scene.memory_estimate.peak),
                megabytes(scene.memory_estimate.kept),
                if scene.is_compact { ", compact" } else { "" },
                scene.build_quality.name(),
                megabytes(film)
            ),
        ),
    ];
    for (name, value) in facts(&scene, hash).into_iter().chain(costs) {
        print(&format!("  {name:<12} {value}"));
    }
    Ok(Outcome::Done)
}

/// Name and value of every fact; what is absent is not named.
fn facts(scene: &Scene, hash: u64) -> Vec<(&'static str, String)> {
    let r = &scene.requirements;
    let mut facts = Vec::new();
    let mut fact = |name, value: String| facts.push((name, value));
    let counted = |n: u64, one: &str, many: &str| match n {
        0 => None,
        1 => Some(format!("1 {one}")),
        n => Some(format!("{} {many}", grouped(n))),
    };
    let joined = |parts: &[Option<String>]| {
        let parts: Vec<String> = parts.iter().flatten().cloned().collect();
        if parts.is_empty() { "nothing".to_owned() } else { parts.join(", ") }
    };
    let mut geometry = vec![
        counted(r.triangles, "triangle", "triangles"),
        counted(r.smooth_meshes, "mesh with shading normals", "meshes with shading normals"),
    ];
    geometry.extend(r.shapes.iter().map(|&([one, many], n)| counted(n, one, many)));
    fact("geometry", joined(&geometry));
    for (name, made) in
        std::iter::once("freeform").chain(std::iter::repeat("")).zip(&scene.tessellations)
    {
        let [one, many] = made.kind;
        fact(
            name,
            joined(&[counted(made.patches as u64, one, many)])
                + &format!(" became {} triangles, ", grouped(made.triangles as u64))
                + &format!("at most {} ({:.1e} m) off", made.tolerance, made.distance),
        );
    }
    if r.copies > 0 {
        let prototypes = counted(r.prototypes, "prototype", "prototypes").unwrap_or_default();
        let copies = counted(r.copies, "copy", "copies").unwrap_or_default();
        fact(
            "instances",
            format!("{copies} of {prototypes}, primitives drawn: {}", grouped(r.drawn_primitives)),
        );
    }
    let b = scene.bounds.translated(scene.center);
    if b.is_empty() {
        fact("bounds", "none: the picture shows the background".to_owned());
    } else {
        fact("bounds", format!("{} to {}", b.min, b.max));
    }
    if scene.center != glam::DVec3::ZERO {
        fact(
            "recentred",
            format!("by {}: coordinates are far compared with their extent", scene.center),
        );
    }
    fact(
        "lights",
        if r.lit_automatically {
            "none: lit from the camera's side".to_owned()
        } else {
            joined(&[
                counted(r.point_lights, "point light", "point lights"),
                counted(
                    r.lecture_lights,
                    "point light without falloff",
                    "point lights without falloff",
                ),
                counted(r.directional_lights, "directional light", "directional lights"),
                counted(r.spot_lights, "spot light", "spot lights"),
                counted(r.area_lights, "area light", "area lights"),
                (!scene.ambient.is_black()).then(|| "ambient light".to_owned()),
            ])
        },
    );
    let needed = requirements(scene);
    fact("requires", needed.first().cloned().unwrap_or_default());
    for line in needed.into_iter().skip(1) {
        fact("", line);
    }
    let s = &scene.settings;
    fact(
        "picture",
        format!(
            "{} x {}, {} samples, filter `{}`",
            scene.size[0],
            scene.size[1],
            s.samples,
            s.filter.name()
        ),
    );
    fact("hash", format!("{hash:016x}"));
    facts
}

/// What the scene needs and why, a line each: first the code that is run for it.
fn requirements(scene: &Scene) -> Vec<String> {
    let r = &scene.requirements;
    let s = &scene.settings;
    let is_tree = s.integrator == IntegratorKind::Whitted;
    let is_lit = is_tree || s.integrator == IntegratorKind::Direct;
    let mut needed = vec![format!("integrator `{}`", s.integrator.name())];
    if is_lit {
        needed[0] += &format!(", compiled for `{}`", r.variant.name());
    }
    let mut need = |is_there: bool, what: &str| {
        if is_there {
            needed.push(what.to_owned());
        }
    };
    need(r.shadow_rays, "shadow rays, as there are lights");
    need(is_lit && r.specular_materials > 0, "highlights, as there are specular materials");
    need(is_tree && r.mirrors > 0, "mirrored rays, as there are materials that mirror");
    need(is_tree && r.dielectrics > 0, "refracted rays, as there is glass");
    need(is_tree && r.dispersive > 0, "single wavelengths, as there is glass that disperses");
    need(r.transparent_shadows, "shadow rays through glass, as `shadows` asks for it");
    need(r.textured_materials > 0, "textures, as materials have them");
    need(is_lit && r.area_lights > 0, "points on lights drawn at random, as some have an area");
    need(
        is_lit && r.picks_lights,
        "lights drawn from a tree, as there are more than `light_samples`",
    );
    need(is_lit && r.glows, "light of surfaces that are seen, as some glow");
    need(is_lit && r.fog, "transmittances of fog, as there is a `[medium]`");
    need(is_lit && r.volumes > 0, "integrals along rays, as there are `[[volumes]]`");
    need(r.lens, "points on a lens drawn at random, as the camera has one");
    need(!r.shapes.is_empty(), "user geometry, as there are shapes that are no triangles");
    need(r.copies > 0, "a second level, as there are instances");
    needed
}
