//! Finds the installed Ipopt, compiles the exception guard against its headers and generates
//! bindings to the guard.
//!
//! `pkg-config --libs ipopt` is not used for linking: Debian's file lists `-llapack -lblas`, whose
//! development links may be missing. The linker only gets the name `libipopt`, which knows its own
//! dependencies.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::exit;

/// Folders of an installation of Ipopt.
struct Installation {
    include_dirs: Vec<PathBuf>,
    lib_dir: Option<PathBuf>,
}

fn main() {
    println!("cargo:rerun-if-env-changed=IPOPT_INCLUDE_DIR");
    println!("cargo:rerun-if-env-changed=IPOPT_LIB_DIR");
    println!("cargo:rerun-if-changed=guard/guard.cpp");
    println!("cargo:rerun-if-changed=guard/guard.h");

    let installation = find_ipopt().unwrap_or_else(|why| fail(&why));
    let version = header_version(&installation.include_dirs).unwrap_or_else(|why| fail(&why));
    generate_bindings(&installation.include_dirs);
    compile_guard(&installation.include_dirs);

    if let Some(dir) = &installation.lib_dir {
        println!("cargo:rustc-link-search=native={}", dir.display());
    }
    println!("cargo:rustc-link-lib=dylib=ipopt");
    println!("cargo:rustc-env=IPOPT_SYS_VERSION={version}");
    // Dependent build scripts read this as DEP_IPOPT_VERSION.
    println!("cargo:version={version}");
}

/// Ends the build with a readable message instead of a backtrace.
fn fail(why: &str) -> ! {
    println!("cargo:warning=ipopt-sys: {why}");
    eprintln!("\nipopt-sys: {why}\n");
    exit(1);
}

/// Locates Ipopt by the environment variables, or else by pkg-config.
fn find_ipopt() -> Result<Installation, String> {
    if let Some(include) = env::var_os("IPOPT_INCLUDE_DIR") {
        return Ok(Installation {
            include_dirs: vec![include.into()],
            lib_dir: env::var_os("IPOPT_LIB_DIR").map(PathBuf::from),
        });
    }
    let package = pkg_config::Config::new().cargo_metadata(false).probe("ipopt").map_err(|_| {
        "Ipopt was not found by pkg-config. On Debian install it with `apt-get install \
             coinor-libipopt-dev pkg-config` (the project's scripts/setup does this), or set \
             IPOPT_INCLUDE_DIR to the folder that holds IpStdCInterface.h and IPOPT_LIB_DIR to \
             the folder that holds libipopt.so"
            .to_owned()
    })?;
    let lib_dir = env::var_os("IPOPT_LIB_DIR")
        .map(PathBuf::from)
        .or_else(|| pkg_config::get_variable("ipopt", "libdir").ok().map(PathBuf::from));
    Ok(Installation { include_dirs: package.include_paths, lib_dir })
}

/// Version in the headers: `#define IPOPT_VERSION "3.11.9"`.
fn header_version(include_dirs: &[PathBuf]) -> Result<String, String> {
    for dir in include_dirs {
        let Ok(text) = fs::read_to_string(dir.join("IpoptConfig.h")) else {
            continue;
        };
        let version = text
            .lines()
            .filter_map(|line| line.trim().strip_prefix("#define IPOPT_VERSION "))
            .map(|value| value.trim().trim_matches('"').to_owned())
            .next();
        return version.ok_or_else(|| {
            format!("{} defines no IPOPT_VERSION", dir.join("IpoptConfig.h").display())
        });
    }
    Err(format!(
        "IpoptConfig.h was not found in {}; on Debian it belongs to the package \
         coinor-libipopt-dev",
        include_dirs.iter().map(|dir| dir.display().to_string()).collect::<Vec<_>>().join(", ")
    ))
}

fn generate_bindings(include_dirs: &[PathBuf]) {
    let out = Path::new(&env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join("bindings.rs");
    let bindings = bindgen::Builder::default()
        .header("guard/guard.h")
        .clang_args(include_dirs.iter().map(|dir| format!("-I{}", dir.display())))
        // Functions of Ipopt are only reachable through the guard.
        .allowlist_function("ipopt_sys_.*")
        .allowlist_type("Bool|ApplicationReturnStatus|AlgorithmMode|UserDataPtr")
        // A C enum may hold values that the header does not list, so it becomes a module of
        // constants.
        .default_enum_style(bindgen::EnumVariation::ModuleConsts)
        .generate_comments(false)
        .layout_tests(false)
        .generate()
        .unwrap_or_else(|error| {
            fail(&format!(
                "bindgen could not read Ipopt's header: {error}. It needs libclang (Debian \
                 package libclang-dev)"
            ))
        });
    if let Err(error) = bindings.write_to_file(&out) {
        fail(&format!("could not write {}: {error}", out.display()));
    }
}

fn compile_guard(include_dirs: &[PathBuf]) {
    cc::Build::new()
        .cpp(true)
        .std("c++11")
        .includes(include_dirs)
        .include("guard")
        .file("guard/guard.cpp")
        .warnings(true)
        // Version 3.14 deprecates the type names, but 3.11 has no others.
        .flag_if_supported("-Wno-deprecated-declarations")
        .compile("ipopt_sys_guard");
}
