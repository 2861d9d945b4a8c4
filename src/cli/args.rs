//! Flags as typed.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Parser, Subcommand};

use super::compare::{ChannelLimit, parse_channel_limit};
use super::units::{
    Part, parse_bytes, parse_count, parse_crop, parse_part, parse_share, parse_size, parse_time,
};
use crate::accel::{AccelKind, BuildQuality, Precision};
use crate::film::{Aov, Filter, PixelRect};
use crate::geometry::generate::GeneratedKind;
use crate::io::{ExrCompression, ExrLayout, NonFinite, PixelType, ToneMap};
use crate::measure::bench::StructureKind;
use crate::scene::IntegratorKind;

/// Alhazen: a scene or a bare mesh in, an HDR EXR picture out, fast, with a known error.
#[derive(Debug, Parser)]
#[command(
    name = "alhazen",
    version,
    max_term_width = 100,
    after_help = "\
Start here:
  alhazen render bunny.ply                    any mesh: framed and lit by itself, to bunny.exr
  alhazen render scene.toml -o out.exr -o out.png
  alhazen render scene.toml --size 640x360 --samples 4 --set camera.fov=30
  alhazen render scene.toml --checkpoint 60s  may be interrupted: --resume goes on
  alhazen inspect scene.toml                  what it holds, what it requires, what it costs
  alhazen compare out.exr reference.exr       how far a picture is from a reference
  alhazen bench bunny.ply --html bench.html   how fast and how right accelerators are on it
  alhazen trade scene.toml --error 1% --html trade.html    which settings reach 1 %, soonest
  alhazen generate terrain --triangles 10M -o terrain.ply

Exit codes: 0 done, 1 the render failed or a comparison exceeded a limit, 2 bad input or usage, 130 interrupted
(once rendering had begun, a valid picture is on disk).
The scene format is described in docs/scene.md."
)]
pub(super) struct Args {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Render a scene (.toml) or a bare mesh (.ply, .obj, .stl) to EXR, HDR or PNG
    Render(RenderArgs),
    /// Join the parts of a picture that were rendered with --part, to the same picture as in one piece
    Merge(MergeArgs),
    /// Say what a scene holds, what it requires of the renderer, and what it costs to build
    Inspect(InspectArgs),
    /// Say how far a picture is from a reference (EXR or PNG): MSE, relMSE, PSNR, FLIP
    Compare(CompareArgs),
    /// Measure accelerators on the rays of a scene: build time, memory, speed, agreement
    Bench(BenchArgs),
    /// Measure what speed costs in accuracy on a scene, knob by knob; recommend settings for an error or a time
    Trade(TradeArgs),
    /// Write a test mesh of any size, the same for the same seed
    Generate(GenerateArgs),
}

/// What chooses and changes a scene.
#[derive(Debug, clap::Args)]
pub(super) struct SceneArgs {
    /// The scene: .toml, or a bare mesh (.ply, .obj, .stl), which is framed and lit by itself
    pub(super) scene: PathBuf,

    /// Sets any field of the scene, as in `--set camera.fov=30` or `--set objects.0.radius=2`; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(super) set: Vec<String>,

    /// The camera to use, of several named ones
    #[arg(long, value_name = "NAME")]
    pub(super) camera: Option<String>,

    /// Picture size in pixels, as in 1920x1080
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(super) size: Option<[u32; 2]>,

    /// Samples per pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub(super) samples: Option<u32>,

    /// Algorithm: `whitted` traces mirrors and glass, `direct` is local illumination with shadows, `flat`
    /// shows colours without light, `ao` how open each place lies
    #[arg(long, value_name = "NAME", value_parser = by_name(&IntegratorKind::ALL, IntegratorKind::name))]
    pub(super) integrator: Option<IntegratorKind>,

    /// Bounces of mirrored and refracted rays; 0 is the camera ray and its direct light
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1 << 20))]
    pub(super) max_depth: Option<u32>,

    /// How exact ray queries are: `fast` loses some rays at edges and far from the origin, `robust` only a
    /// few that meet a vertex exactly, `exact` none (always our own hierarchy)
    #[arg(long, value_name = "NAME", value_parser = by_name(&Precision::ALL, Precision::name))]
    pub(super) precision: Option<Precision>,

    /// Work put into the hierarchy: `low` is fast to build, `high` (with --precision fast) fast to trace, `auto`
    /// goes by how many rays are expected
    #[arg(long, value_name = "NAME", value_parser = by_name(&BuildQuality::ALL, BuildQuality::name))]
    pub(super) build_quality: Option<BuildQuality>,

    /// Reconstruction filter
    #[arg(long, value_name = "NAME", value_parser = by_name(&Filter::ALL, Filter::name))]
    pub(super) filter: Option<Filter>,

    /// Threads; all of the machine's where not given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    pub(super) threads: Option<u16>,

    /// Half the memory for the hierarchy, for rays that are 1.4 to 1.8 times slower; taken anyway where it
    /// would not fit otherwise
    #[arg(long)]
    pub(super) compact: bool,

    /// What becomes of triangles with NaN or infinite coordinates, where an object does not say: `drop`
    /// leaves them out with a warning, `refuse` is an error
    #[arg(long, value_name = "NAME", default_value = NonFinite::ALL[0].name(),
          value_parser = by_name(&NonFinite::ALL, NonFinite::name))]
    pub(super) non_finite: NonFinite,

    /// Most memory that the hierarchy may take, as in 8G or 512M; more is an error before it is built.
    /// Without it: what the machine has free
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    pub(super) memory_limit: Option<u64>,

    /// No progress, warnings or closing table: only errors (and what `inspect` is asked for)
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// What answers ray queries.
#[derive(Debug, clap::Args)]
pub(super) struct AccelArgs {
    /// What answers ray queries; `bvh` is our own hierarchy, and `brute` an f64 loop over everything, for
    /// small scenes and comparison
    #[arg(id = "accel", long, value_name = "NAME", default_value = AccelKind::ALL[0].name(),
          value_parser = by_name(AccelKind::ALL, AccelKind::name))]
    pub(super) kind: AccelKind,

    /// Traces rays that run close together one by one too: to see what packets bring
    #[arg(long)]
    pub(super) single_rays: bool,
}

#[derive(Debug, clap::Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,

    #[command(flatten)]
    pub(super) accel: AccelArgs,

    /// File to write, .exr, .hdr or .png; repeatable. Without it: the scene's name with .exr, in this folder
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: Vec<PathBuf>,

    /// Render only these pixels (x1 and y1 are not included); the EXR's data window says so
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse_crop)]
    pub(super) crop: Option<PixelRect>,

    /// Seed of all random numbers: same scene and seed, same picture
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) seed: u64,

    /// Ends at a relative sampling error of the picture, as in 1% or 0.01, however many samples that takes.
    /// With several of --error, --time and --samples, what comes first ends it
    #[arg(long, value_name = "SHARE", value_parser = parse_share, conflicts_with = "crop")]
    pub(super) error: Option<f64>,

    /// Ends so that the files are written this long after the start, as in 30s, 5m or 1h30m. One sample
    /// of every pixel is taken in any case
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub(super) time: Option<Duration>,

    /// More samples where the error is, as --error or --time allow; the number of samples then is a mean.
    /// May shift the picture a little: docs/scene.md says how much
    #[arg(long, conflicts_with = "part")]
    pub(super) adaptive: bool,

    /// Keeps how far the render is, about this often and when it is interrupted, beside the first output
    /// file (NAME.checkpoint.exr); removed once that is written
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub(super) checkpoint: Option<Duration>,

    /// Goes on from that file, to the same picture as without a pause; from the start where there is none.
    /// Keeps on writing it, every 60 s where --checkpoint does not say otherwise
    #[arg(long)]
    pub(super) resume: bool,

    /// Takes only part K of the samples, of N, for `alhazen merge`: 1/8 to 8/8. The file is a picture too
    #[arg(long, value_name = "K/N", value_parser = parse_part, conflicts_with_all = ["error", "time"])]
    pub(super) part: Option<Part>,

    /// Shows the picture in tev while it is rendered, as in localhost:14158
    #[arg(long, value_name = "HOST:PORT")]
    pub(super) tev: Option<String>,

    /// Writes the picture so far as PNG, again and again
    #[arg(long, value_name = "FILE.png")]
    pub(super) preview: Option<PathBuf>,

    /// How often that is
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = parse_time)]
    pub(super) preview_every: Duration,

    /// Layers of EXR files beside the colours: all, or names separated by commas; see docs/output.md
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = layer_names())]
    pub(super) layers: Vec<LayerName>,

    #[command(flatten)]
    pub(super) format: FormatArgs,

    /// Write times, rays, memory and error as JSON
    #[arg(long, value_name = "FILE.json")]
    pub(super) stats: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(super) struct MergeArgs {
    /// The parts, in any order
    #[arg(required = true, value_name = "PART.exr")]
    pub(super) parts: Vec<PathBuf>,

    /// File to write, .exr, .hdr or .png; repeatable
    #[arg(long, short, value_name = "FILE", required = true)]
    pub(super) output: Vec<PathBuf>,

    #[command(flatten)]
    pub(super) format: FormatArgs,

    /// Threads; all of the machine's where not given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    pub(super) threads: Option<u16>,

    /// No closing table: only errors and warnings
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// How pictures are written.
#[derive(Debug, clap::Args)]
pub(super) struct FormatArgs {
    /// Exposure of PNG files, in stops: 1 doubles the light
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(super) exposure: f32,

    /// Tone curve of PNG files: `srgb` clips what is brighter than 1, `filmic` has a toe and a shoulder
    #[arg(long, value_name = "NAME", default_value = ToneMap::ALL[0].name(),
          value_parser = by_name(&ToneMap::ALL, ToneMap::name))]
    pub(super) tonemap: ToneMap,

    /// Channel type of EXR files; a picture that half cannot hold is written as float
    #[arg(long, value_name = "TYPE", default_value = PixelType::ALL[0].name(),
          value_parser = by_name(&PixelType::ALL, PixelType::name))]
    pub(super) exr_type: PixelType,

    /// Compression of EXR files
    #[arg(long, value_name = "NAME", default_value = "zip",
          value_parser = by_name(&ExrCompression::ALL, ExrCompression::name))]
    pub(super) exr_compression: ExrCompression,

    /// How EXR files group pixels: rows, or tiles of 64 x 64
    #[arg(long, value_name = "NAME", default_value = ExrLayout::ALL[0].name(),
          value_parser = by_name(&ExrLayout::ALL, ExrLayout::name))]
    pub(super) exr_layout: ExrLayout,
}

#[derive(Debug, clap::Args)]
pub(super) struct InspectArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,

    #[command(flatten)]
    pub(super) accel: AccelArgs,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Values are linear: those of PNG files are decoded from sRGB. Means run over pixels and channels; relmse \
divides each squared difference by the square of the reference plus 0.01. Pixels that are NaN or infinite \
are left out of all metrics; where any limit is given, they fail it.

FLIP is how different the pictures look, from 0 to 1, at 67 pixels per degree: `flip` on a display that \
clips to [0, 1], `hdr-flip` the largest over exposures that suit the reference.")]
pub(super) struct CompareArgs {
    /// The picture, .exr or .png
    pub(super) picture: PathBuf,

    /// What it should look like, .exr or .png, of the same size
    pub(super) reference: PathBuf,

    /// Largest mean squared error; more is exit code 1, as with the limits below
    #[arg(long, value_name = "X", value_parser = parse_limit)]
    pub(super) max_mse: Option<f64>,

    /// Largest mean absolute error
    #[arg(long, value_name = "X", value_parser = parse_limit)]
    pub(super) max_mae: Option<f64>,

    /// Largest relative mean squared error
    #[arg(long, value_name = "X", value_parser = parse_limit)]
    pub(super) max_relmse: Option<f64>,

    /// Least peak signal-to-noise ratio, in decibels
    #[arg(long, value_name = "DB", value_parser = parse_limit)]
    pub(super) min_psnr: Option<f64>,

    /// Largest mean FLIP
    #[arg(long, value_name = "X", value_parser = parse_limit)]
    pub(super) max_flip: Option<f64>,

    /// Largest mean HDR-FLIP; implies --hdr-flip
    #[arg(long, value_name = "X", value_parser = parse_limit)]
    pub(super) max_hdr_flip: Option<f64>,

    /// Also HDR-FLIP, which looks at all exposures: several times as long as the rest
    #[arg(long)]
    pub(super) hdr_flip: bool,

    /// Also every channel and layer by itself; channels that only one file has are an error
    #[arg(long)]
    pub(super) channels: bool,

    /// Largest error of a channel or layer, as in `Z:mae=0.01` or `normal:max=1e-4`; metrics: mse, mae, relmse,
    /// psnr (the least), flip, max, differing (ids of a Cryptomatte); implies --channels, repeatable
    #[arg(long, value_name = "CHANNEL:METRIC=X", value_parser = parse_channel_limit)]
    pub(super) limit: Vec<ChannelLimit>,

    /// Write a picture of the difference: .png shows FLIP from black to yellow (cyan: not finite), .exr
    /// holds absolute differences
    #[arg(long, value_name = "FILE")]
    pub(super) difference: Option<PathBuf>,

    /// Write the metrics as JSON
    #[arg(long, value_name = "FILE.json")]
    pub(super) json: Option<PathBuf>,

    /// No table: only errors and exceeded limits
    #[arg(long, short)]
    pub(super) quiet: bool,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Rays are recorded from the scene: those of the camera for one sample of the picture (--size), and a shadow, a \
reflection and a diffuse ray from each first hit. Ratios are to the first accelerator, in the same rounds; \
slow ones trace fewer rays. What is measured, and what the columns mean, is told in docs/bench.md.")]
pub(super) struct BenchArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,

    /// Accelerator to measure, beside the first; repeatable. Without it: all
    #[arg(long, value_name = "NAME", value_parser = structure())]
    pub(super) accel: Vec<StructureKind>,

    /// Seconds for which each traces rays, about; its builds and checks take as long again, and longer where
    /// one build does
    #[arg(long, value_name = "S", default_value_t = 4.0, value_parser = parse_seconds)]
    pub(super) seconds: f64,

    /// Rounds of which medians are taken
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub(super) rounds: u16,

    /// Rays of each kind, at most: of a larger picture some tiles are taken
    #[arg(long, value_name = "N", default_value_t = 1 << 20, value_parser = clap::value_parser!(u32).range(1024..=1 << 26))]
    pub(super) rays: u32,

    /// Write what was measured as JSON
    #[arg(long, value_name = "FILE.json")]
    pub(super) json: Option<PathBuf>,

    /// Write it as a page with bar charts, which needs nothing else
    #[arg(long, value_name = "FILE.html")]
    pub(super) html: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
A reference is rendered first, with nothing cut short that costs accuracy; then the scene as it stands, with \
other numbers of samples, and with each choice of the knobs that matter to it. Errors are relative, as `render` \
states them, bias included. docs/trade.md tells what is measured, and how.")]
pub(super) struct TradeArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,

    #[command(flatten)]
    pub(super) accel: AccelArgs,

    /// Find settings for this relative error, bias included, as in 1% or 0.01; repeatable. Exit code 1
    /// where none are found
    #[arg(long, value_name = "SHARE", value_parser = parse_share)]
    pub(super) error: Vec<f64>,

    /// Find settings for this time from start to file written, as in 30s; repeatable
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub(super) time: Vec<Duration>,

    /// Compare with this picture, .exr or .png, of the same size
    #[arg(long, value_name = "FILE")]
    pub(super) reference: Option<PathBuf>,

    /// Samples per pixel of the reference; 16 times those of the scene where not given, 256 to 4096
    #[arg(long, value_name = "N", conflicts_with = "reference",
          value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    pub(super) reference_samples: Option<u32>,

    /// Interleaved rounds of which medians of times are taken
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub(super) rounds: u16,

    /// Folder in which references are kept; alhazen in the user's folder for caches where not given
    #[arg(long, value_name = "FOLDER")]
    pub(super) cache: Option<PathBuf>,

    /// Neither keeps references nor uses one that is kept
    #[arg(long, conflicts_with = "cache")]
    pub(super) no_cache: bool,

    /// Write a page with charts and pictures, which needs nothing else
    #[arg(long, value_name = "FILE.html")]
    pub(super) html: Option<PathBuf>,

    /// Write what was measured as JSON
    #[arg(long, value_name = "FILE.json")]
    pub(super) json: Option<PathBuf>,

    /// Write it as comma-separated values
    #[arg(long, value_name = "FILE.csv")]
    pub(super) csv: Option<PathBuf>,
}

impl TradeArgs {
    /// The folder that references are kept in; none where there is none.
    pub(super) fn cache(&self) -> Option<PathBuf> {
        if self.no_cache {
            return None;
        }
        let folder =
            |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
        let user = || folder("XDG_CACHE_HOME").or_else(|| Some(folder("HOME")?.join(".cache")));
        self.cache.clone().or_else(|| Some(user()?.join("alhazen")))
    }
}

/// A parser of one of the structures that can be measured.
fn structure() -> impl TypedValueParser<Value = StructureKind> {
    let names = StructureKind::all().into_iter().map(StructureKind::name);
    PossibleValuesParser::new(names).map(|text| {
        let found = StructureKind::all().into_iter().find(|kind| kind.name() == text);
        found.unwrap_or_else(|| unreachable!("the parser accepts these names only"))
    })
}

/// A time in seconds.
fn parse_seconds(text: &str) -> Result<f64, String> {
    let text = text.trim().trim_end_matches('s');
    let seconds = text.parse().ok().filter(|x: &f64| *x > 0.0 && *x <= 86_400.0);
    seconds.ok_or_else(|| "expected a number of seconds, more than 0, at most 86400".to_owned())
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Kinds:
  terrain   fractal hills, 100 by 100 m, open at the edges
  sphere    a ball with a displaced surface, closed, of radius 1 m
  blobs     a displaced closed shell of radius 10 m with 100 displaced closed blobs in it
  slivers   triangles of their own, 1 to 6 m long and 4 mm wide, in a cube of 100 m
  soup      triangles of their own in a cube of 2 m; the more there are, the smaller

The mesh is written in pieces as it is made: any number of triangles takes a few MB of memory.")]
pub(super) struct GenerateArgs {
    /// What to generate
    #[arg(value_name = "KIND", hide_possible_values = true,
          value_parser = by_name(&GeneratedKind::ALL, GeneratedKind::name))]
    pub(super) kind: GeneratedKind,

    /// File to write, .ply or .stl (binary, little-endian)
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: PathBuf,

    /// Number of triangles, as in 500k or 10M; where the surface is a grid, as many as fit into a whole
    /// one: a little fewer
    #[arg(long, short = 'n', value_name = "N", default_value = "1M", value_parser = parse_count)]
    pub(super) triangles: u64,

    /// Same kind, number and seed: same file
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) seed: u32,

    /// Threads; all of the machine's where not given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    pub(super) threads: Option<u16>,

    /// No progress and no closing line: only errors
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// What `--layers` names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LayerName {
    All,
    One(Aov),
}

fn layer_names() -> impl TypedValueParser<Value = LayerName> {
    let names = ["all"].into_iter().chain(Aov::ALL.into_iter().map(Aov::name));
    PossibleValuesParser::new(names).map(|text| {
        let found = Aov::ALL.into_iter().find(|aov| aov.name() == text);
        found.map_or(LayerName::All, LayerName::One)
    })
}

/// A limit of a metric.
/// A number that is not negative.
pub(super) fn parse_limit(text: &str) -> Result<f64, String> {
    let limit = text.trim().parse().ok().filter(|x: &f64| x.is_finite() && *x >= 0.0);
    limit.ok_or_else(|| "expected a number that is not negative".to_owned())
}

/// A parser of one of several names.
fn by_name<T: Copy + Send + Sync + 'static>(
    all: &'static [T],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.iter().map(|&t| name(t))).map(move |text| {
        let found = all.iter().find(|&&t| name(t) == text);
        *found.unwrap_or_else(|| unreachable!("the parser accepts these names only"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }
}
