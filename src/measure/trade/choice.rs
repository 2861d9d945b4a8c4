//! What can be chosen about a render, as flags of the command line; and which choices matter to a scene.

use crate::accel::{AccelKind, BuildOptions, BuildQuality, Compact, Precision};
use crate::scene::{Epsilon, IntegratorKind, RenderSettings, Scene, Shadows, Tolerance};
use crate::texture::TexelFilter;

/// A way to render a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// What scene files say, the number of samples among it.
    pub settings: RenderSettings,
    /// The accelerator.
    pub kind: AccelKind,
    /// Whether rays are traced one by one.
    pub single_rays: bool,
    /// The relative sampling error at which it ends.
    pub error: Option<f64>,
    /// Whether pixels have more samples where the error is.
    pub is_adaptive: bool,
}

impl Choice {
    /// What a scene says, with the default accelerator.
    pub fn of(settings: RenderSettings) -> Self {
        let kind = AccelKind::default();
        Self { settings, kind, single_rays: false, error: None, is_adaptive: false }
    }

    /// How its accelerator is built.
    pub fn build_options(&self) -> BuildOptions {
        BuildOptions { kind: self.kind, single_rays: self.single_rays, ..BuildOptions::default() }
    }

    /// The flags of `alhazen render` that make this of `base`.
    pub fn flags(&self, base: &Self) -> Vec<String> {
        let (a, b) = (&self.settings, &base.settings);
        let mut flags = Vec::new();
        let mut say = |is_other: bool, words: [String; 2]| {
            if is_other {
                flags.extend(words.into_iter().filter(|word| !word.is_empty()));
            }
        };
        let flag = |name: &str, value: String| [format!("--{name}"), value];
        let set = |name: &str, value: String| ["--set".into(), format!("render.{name}={value}")];
        say(a.samples != b.samples, flag("samples", a.samples.to_string()));
        say(a.max_depth != b.max_depth, flag("max-depth", a.max_depth.to_string()));
        say(a.precision != b.precision, flag("precision", a.precision.name().into()));
        say(
            a.build_quality != b.build_quality,
            flag("build-quality", a.build_quality.name().into()),
        );
        say(self.kind != base.kind, flag("accel", self.kind.name().into()));
        say(self.single_rays && !base.single_rays, flag("single-rays", String::new()));
        say(a.prune != b.prune, set("prune", a.prune.to_string()));
        say(a.roulette != b.roulette, set("roulette", a.roulette.to_string()));
        let shadows = match a.shadows {
            Shadows::None => "false".to_owned(),
            shadows => format!("\"{}\"", shadows.name()),
        };
        say(a.shadows != b.shadows, set("shadows", shadows));
        say(
            a.shadow_samples != b.shadow_samples,
            set("shadow_samples", a.shadow_samples.to_string()),
        );
        say(a.light_samples != b.light_samples, set("light_samples", a.light_samples.to_string()));
        if let Some(filter) = a.texture_filter.filter(|_| a.texture_filter != b.texture_filter) {
            say(true, set("texture_filter", filter.name().into()));
        }
        if let Some(nanometres) = a.wavelength.filter(|_| a.wavelength != b.wavelength) {
            say(true, set("wavelength", nanometres.to_string()));
        }
        let epsilon = match a.epsilon {
            Epsilon::Auto => "\"auto\"".to_owned(),
            Epsilon::Fixed(x) => format!("{x:e}"),
        };
        say(a.epsilon != b.epsilon, set("epsilon", epsilon));
        let tolerance = match a.tolerance {
            Tolerance::Pixels(x) => x.to_string(),
            Tolerance::Meters(x) => format!("\"{x} m\""),
        };
        say(a.tolerance != b.tolerance, set("tolerance", tolerance));
        let compact = match a.compact {
            Compact::Auto => "\"auto\"",
            Compact::On => "true",
            Compact::Off => "false",
        };
        say(a.compact != b.compact, set("compact", compact.into()));
        if let Some(error) = self.error.filter(|_| self.error != base.error) {
            say(true, flag("error", error.to_string()));
        }
        say(self.is_adaptive && !base.is_adaptive, flag("adaptive", String::new()));
        flags
    }
}

/// What a knob turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Time, and how far samples scatter: the expected picture stays.
    Noise,
    /// Time, and the expected picture with it.
    Bias,
    /// What the picture is meant to show, or may show in a few places: never recommended.
    Look,
}

/// A knob, with the choices that it has beside that of the scene.
#[derive(Debug, Clone)]
pub struct Knob {
    /// What it is called in scene files or on the command line.
    pub name: &'static str,
    /// What it does.
    pub effect: Effect,
    /// What each is called, and what it is.
    pub choices: Vec<(String, Choice)>,
}

/// The knobs that matter to a scene, and only those.
pub fn knobs(scene: &Scene, base: &Choice) -> Vec<Knob> {
    let r = &scene.requirements;
    let settings = &base.settings;
    let has_tree = has_tree(scene);
    let traces_more = has_tree || r.shadow_rays || settings.integrator == IntegratorKind::Ao;
    let mut knobs = Vec::new();
    let mut add = |name, effect, choices: Vec<(String, Choice)>| {
        let choices: Vec<_> = choices.into_iter().filter(|(_, choice)| choice != base).collect();
        if !choices.is_empty() {
            knobs.push(Knob { name, effect, choices });
        }
    };
    let with = |change: &dyn Fn(&mut Choice)| {
        let mut choice = base.clone();
        change(&mut choice);
        choice
    };
    if has_tree {
        let depths = [0, 1, 2, 4, 8, 16, 32]
            .map(|depth| (depth.to_string(), with(&|c| c.settings.max_depth = depth)));
        add("max_depth", Effect::Bias, depths.into());
        let prunes = [0.0, 0.001, 0.004, 0.016, 0.064].map(|prune: f32| {
            let change = |c: &mut Choice| (c.settings.prune, c.settings.roulette) = (prune, false);
            (prune.to_string(), with(&change))
        });
        add("prune", Effect::Bias, prunes.into());
        let roulettes = [0.004, 0.064, 0.25, 1.0].map(|prune: f32| {
            let change = |c: &mut Choice| (c.settings.prune, c.settings.roulette) = (prune, true);
            (format!("below {prune}"), with(&change))
        });
        add("roulette", Effect::Noise, roulettes.into());
    }
    if r.area_lights > 0 && r.shadow_rays {
        let counts =
            [1, 2, 4, 16].map(|n| (n.to_string(), with(&|c| c.settings.shadow_samples = n)));
        add("shadow_samples", Effect::Noise, counts.into());
    }
    if r.picks_lights {
        let counts =
            [2, 4, 16, 64].map(|n| (n.to_string(), with(&|c| c.settings.light_samples = n)));
        add("light_samples", Effect::Noise, counts.into());
    }
    if r.shadow_rays && r.dielectrics > 0 {
        let modes = [Shadows::None, Shadows::Opaque, Shadows::Tinted, Shadows::Fresnel]
            .map(|mode| (mode.name().to_owned(), with(&|c| c.settings.shadows = mode)));
        add("shadows", Effect::Look, modes.into());
    }
    if settings.integrator != IntegratorKind::Ao {
        let others = TexelFilter::ALL.into_iter();
        let others = others.filter(|&filter| scene.texture_filters().any(|other| other != filter));
        let filters = others.map(|filter| {
            (filter.name().to_owned(), with(&|c| c.settings.texture_filter = Some(filter)))
        });
        add("texture_filter", Effect::Bias, filters.collect());
    }
    if has_tree && r.dispersive > 0 {
        let yellow = with(&|c| c.settings.wavelength = Some(587.6));
        add("wavelength", Effect::Look, vec![("587.6 nm".into(), yellow)]);
    }
    if !scene.tessellations.is_empty() {
        let factors = [0.25, 0.5, 2.0, 4.0, 8.0].map(|factor| {
            let tolerance = settings.tolerance.times(factor);
            (tolerance.to_string(), with(&|c| c.settings.tolerance = tolerance))
        });
        add("tolerance", Effect::Bias, factors.into());
    }
    let rungs =
        Precision::ALL.map(|rung| (rung.name().to_owned(), with(&|c| c.settings.precision = rung)));
    add("precision", Effect::Bias, rungs.into());
    if traces_more {
        let size = extent(scene);
        let lengths = [1e-6, 1e-5, 1e-4, 1e-3].map(|share: f64| {
            // One digit: nobody chooses more.
            let power = 10f64.powf((share * size).log10().floor());
            let length = ((share * size / power).round() * power) as f32;
            (format!("{length:e}"), with(&|c| c.settings.epsilon = Epsilon::Fixed(length)))
        });
        let auto = ("auto".to_owned(), with(&|c| c.settings.epsilon = Epsilon::Auto));
        // A distance that hardly shows in the mean may still leave spots where things touch.
        add("epsilon", Effect::Look, [auto].into_iter().chain(lengths).collect());
    }
    let qualities = [BuildQuality::Low, BuildQuality::Medium]
        .map(|quality| (quality.name().to_owned(), with(&|c| c.settings.build_quality = quality)));
    // That which `auto` decided on is there.
    let is_new = |quality: BuildQuality| {
        settings.build_quality != BuildQuality::Auto || quality != scene.build_quality
    };
    let qualities = qualities.into_iter().filter(|(_, c)| is_new(c.settings.build_quality));
    let high = with(&|c| {
        (c.settings.build_quality, c.settings.precision) = (BuildQuality::High, Precision::Fast);
    });
    add("build_quality", Effect::Bias, qualities.chain([("high, fast".into(), high)]).collect());
    let compact = [("true", Compact::On), ("false", Compact::Off)]
        .map(|(name, compact)| (name.into(), with(&|c| c.settings.compact = compact)));
    let compact =
        compact.into_iter().filter(|(_, c)| c.settings.compact != Compact::Off || scene.is_compact);
    add("compact", Effect::Bias, compact.collect());
    let kinds = AccelKind::ALL.iter().filter(|kind| **kind != AccelKind::Brute);
    let kinds = kinds.map(|kind| (kind.name().to_owned(), with(&|c| c.kind = *kind)));
    add("accel", Effect::Bias, kinds.collect());
    add("packets", Effect::Bias, vec![("none".into(), with(&|c| c.single_rays = true))]);
    knobs
}

/// Whether rays of it branch.
pub(super) fn has_tree(scene: &Scene) -> bool {
    let r = &scene.requirements;
    scene.settings.integrator == IntegratorKind::Whitted && (r.mirrors > 0 || r.dielectrics > 0)
}

/// The largest extent of what has one, in metres.
fn extent(scene: &Scene) -> f64 {
    let size = scene.bounds.size().max_element();
    if size.is_finite() && size > 0.0 { size } else { 1.0 }
}
