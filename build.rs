//! Finds Embree 4 and generates its bindings from the headers that are installed, so that the
//! structures that rays travel in are the very ones the library was built with.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "embree")]
    embree::configure();
}

#[cfg(feature = "embree")]
mod embree {
    use std::env;
    use std::path::{Path, PathBuf};
    use std::process::exit;

    /// Where one Embree lives.
    struct Install {
        /// Holds `embree4/rtcore.h`.
        include: PathBuf,
        /// Holds `libembree4.so`; none where the linker finds it by itself.
        lib: Option<PathBuf>,
        /// The dynamic loader that programs must start with: the prefix brings its own libc.
        loader: Option<PathBuf>,
    }

    pub(crate) fn configure() {
        println!("cargo::rerun-if-env-changed=EMBREE_DIR");
        let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
        let prefix = manifest.join(".embree");
        // Only what exists: cargo takes a missing path for changed, at every build.
        let headers = prefix.join("usr/include/embree4");
        if headers.exists() {
            println!("cargo::rerun-if-changed={}", headers.display());
        }

        let Some(install) = find(&prefix) else {
            fail(
                "Embree 4 was not found in EMBREE_DIR, in the project's .embree, in /usr or in /usr/local.\n\
                 Run `make setup` (Debian, Ubuntu), or set EMBREE_DIR to an Embree 4.3 or newer,\n\
                 or build without it: cargo build --no-default-features",
            )
        };
        link(&install);
        bind(&install);
        // The layout test compiles a C program against the same headers.
        println!("cargo::rustc-env=ALHAZEN_EMBREE_INCLUDE={}", install.include.display());
    }

    fn find(prefix: &Path) -> Option<Install> {
        if let Some(dir) = env::var_os("EMBREE_DIR").filter(|d| !d.is_empty()) {
            let dir = PathBuf::from(dir);
            let lib = library_folder(&dir);
            if lib.is_none() || !has_headers(&dir.join("include")) {
                fail(&format!(
                    "EMBREE_DIR={} holds no include/embree4/rtcore.h or no libembree4.so under lib",
                    dir.display()
                ));
            }
            return Some(Install { include: dir.join("include"), lib, loader: None });
        }
        let usr = prefix.join("usr");
        if has_headers(&usr.join("include")) {
            let loader = usr.join("lib64/ld-linux-x86-64.so.2");
            return Some(Install {
                include: usr.join("include"),
                lib: library_folder(&usr),
                loader: loader.exists().then_some(loader),
            });
        }
        for dir in ["/usr", "/usr/local"].map(Path::new) {
            if has_headers(&dir.join("include")) {
                return Some(Install { include: dir.join("include"), lib: None, loader: None });
            }
        }
        None
    }

    fn has_headers(include: &Path) -> bool {
        include.join("embree4/rtcore.h").is_file()
    }

    /// `lib`, `lib64` or a multiarch folder below `lib`, whichever holds the library.
    fn library_folder(root: &Path) -> Option<PathBuf> {
        let below = std::fs::read_dir(root.join("lib")).into_iter().flatten().flatten();
        [root.join("lib"), root.join("lib64")]
            .into_iter()
            .chain(below.map(|entry| entry.path()))
            .find(|dir| dir.join("libembree4.so").exists())
    }

    fn link(install: &Install) {
        println!("cargo::rustc-link-lib=embree4");
        let Some(lib) = &install.lib else { return };
        println!("cargo::rustc-link-search=native={}", lib.display());
        // RPATH, not RUNPATH: libembree4's own libtbb must be found through it too.
        println!("cargo::rustc-link-arg=-Wl,--disable-new-dtags,-rpath,{}", lib.display());
        if let Some(loader) = &install.loader {
            // The prefix's libc is newer than the system's. A program gets that libc, and the
            // loader that belongs to it; symbols of the newer libc are resolved at run time.
            println!("cargo::rustc-link-arg=-Wl,--dynamic-linker={}", loader.display());
            println!("cargo::rustc-link-arg=-Wl,--allow-shlib-undefined");
        }
    }

    fn bind(install: &Install) {
        let header = install.include.join("embree4/rtcore.h");
        let config = install.include.join("embree4/rtcore_config.h");
        let config = std::fs::read_to_string(&config).unwrap_or_default();
        if !config.contains("#define RTC_MAX_INSTANCE_LEVEL_COUNT 1\n") {
            fail("this Embree was built with more than one level of instances; one is supported");
        }
        if !config.contains("#define EMBREE_GEOMETRY_INSTANCE_ARRAY\n") {
            fail(
                "this Embree has no instance arrays (EMBREE_GEOMETRY_INSTANCE_ARRAY, Embree 4.3 or newer)",
            );
        }
        let bindings = bindgen::Builder::default()
            .header(header.to_string_lossy())
            .clang_arg(format!("-I{}", install.include.display()))
            .allowlist_function("rtc.*")
            .allowlist_type("RTC.*")
            .allowlist_var("RTC_.*")
            // Enumerations stay integers: a library newer than its header may return other values.
            .default_enum_style(bindgen::EnumVariation::Consts)
            .prepend_enum_name(false)
            .derive_default(false)
            .generate_comments(false)
            .generate_inline_functions(false)
            .parse_callbacks(Box::new(bindgen::CargoCallbacks::new()))
            .generate();
        let bindings = match bindings {
            Ok(bindings) => bindings,
            Err(error) => fail(&format!("bindgen cannot read {}: {error}", header.display())),
        };
        let out = PathBuf::from(env::var_os("OUT_DIR").expect("set by cargo"));
        if let Err(error) = bindings.write_to_file(out.join("embree.rs")) {
            fail(&format!("cannot write the bindings: {error}"));
        }
    }

    fn fail(message: &str) -> ! {
        for line in message.lines() {
            println!("cargo::error={line}");
        }
        exit(1)
    }
}
