//! The Debian package: built, installed by the real `dpkg` into a temporary copy of this machine, and started there; and its
//! container, where containers can be built.

use crate::real::free_port;
use crate::running::{Folder, Running, TOKEN};
use serde_json::Value;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
const MODEL: &str = include_str!("../../models/rover.yaml");

/// The package of the program under test, which the first test that asks builds for all.
fn package() -> &'static Path {
    static PACKAGE: OnceLock<PathBuf> = OnceLock::new();
    PACKAGE.get_or_init(|| package_in(Path::new(env!("CARGO_TARGET_TMPDIR")).join("package")))
}

/// Builds the package of the program under test in a folder.
fn package_in(out: PathBuf) -> PathBuf {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let line = [
        "--locked",
        "xtask",
        "package",
        "--program",
        env!("CARGO_BIN_EXE_shsa"),
        "--out",
        out.to_str().unwrap(),
    ];
    let built = Command::new(cargo).args(line).current_dir(ROOT).output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    out.join("shsa.deb")
}

/// A copy of this machine's files whose changes are in memory; dropping it removes them.
struct Machine(PathBuf);

impl Machine {
    fn begin(place: &Path) -> Result<Machine, String> {
        let (memory, root) = (place.join("memory"), place.join("root"));
        [&memory, &root].into_iter().for_each(|folder| fs::create_dir_all(folder).unwrap());
        let mount = |arguments: &[&str]| {
            let mounted = Command::new("mount").args(arguments).stderr(Stdio::null()).status();
            mounted.is_ok_and(|status| status.success()).then_some(()).ok_or("mounting is not allowed here")
        };
        mount(&["-t", "tmpfs", "-o", "size=1g", "tmpfs", memory.to_str().unwrap()])?;
        let machine = Machine(place.to_owned());
        ["upper", "work"].into_iter().for_each(|name| fs::create_dir(memory.join(name)).unwrap());
        let layers = format!("lowerdir=/,upperdir={0}/upper,workdir={0}/work", memory.display());
        mount(&["-t", "overlay", "-o", &layers, "overlay", root.to_str().unwrap()])?;
        // The file systems that maintainer scripts need; no service is running.
        mount(&["-t", "proc", "proc", machine.path("proc").to_str().unwrap()])?;
        mount(&["-t", "tmpfs", "tmpfs", machine.path("run").to_str().unwrap()])?;
        mount(&["--bind", "/dev", machine.path("dev").to_str().unwrap()])?;
        Ok(machine)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join("root").join(name)
    }

    fn command(&self, line: &[&str]) -> Command {
        let mut command = Command::new("chroot");
        command.arg(self.0.join("root")).args(line).env("DEBIAN_FRONTEND", "noninteractive");
        command
    }

    /// Runs the program for a while, or what it has recorded then: where the machine stalls, a need is unmet, which is status 1.
    #[track_caller]
    fn run(&self, line: &[&str]) {
        let Output { status, stderr, .. } = self.command(line).output().unwrap();
        assert!(matches!(status.code(), Some(0 | 1)), "{line:?}: {}", String::from_utf8_lossy(&stderr));
    }

    #[track_caller]
    fn done(&self, line: &[&str]) -> String {
        let Output { status, stdout, stderr } = self.command(line).output().unwrap();
        assert!(status.success(), "{line:?}: {}", String::from_utf8_lossy(&stderr));
        String::from_utf8(stdout).unwrap()
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        for name in ["root/dev", "root/run", "root/proc", "root", "memory"] {
            let _ = Command::new("umount").arg(self.0.join(name)).stderr(Stdio::null()).status();
        }
    }
}

/// A process that is killed when this is dropped.
struct Started(Child);

impl Drop for Started {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits until a run answers on a port.
#[track_caller]
fn health(port: u16) -> Value {
    let end = Instant::now() + Duration::from_secs(60);
    loop {
        if let Ok(mut stream) = std::net::TcpStream::connect(("127.0.0.1", port)) {
            let request =
                format!("GET /state HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n");
            let (status, text) = Running::answer(&mut stream, &request);
            assert_eq!(status, 200, "{text}");
            return serde_json::from_str(&text).unwrap();
        }
        assert!(Instant::now() < end, "it never answers");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn the_package_is_built_installed_started_and_removed() {
    let folder = Folder::new();
    let package = package();
    let machine = match Machine::begin(&folder.path("machine")) {
        Ok(machine) => machine,
        Err(why) => return eprintln!("SKIPPED: the package is built, but not installed: {why}"),
    };
    fs::copy(package, machine.path("shsa.deb")).unwrap();
    // Without triggers: those of other packages bring all manual pages of the machine into an index.
    machine.done(&["dpkg", "--no-triggers", "--install", "/shsa.deb"]);
    assert!(machine.done(&["/usr/bin/shsa", "--version"]).starts_with("shsa "));
    for file in [
        "usr/lib/systemd/system/shsa.service",
        "usr/share/man/man1/shsa-run.1.gz",
        "usr/share/bash-completion/completions/shsa",
        "usr/share/doc/shsa/copyright",
        "usr/share/doc/shsa/sbom.cdx.json",
    ] {
        assert!(machine.path(file).metadata().is_ok_and(|file| file.len() > 100), "{file}");
    }
    let rights = |name: &str| machine.path(name).metadata().unwrap().permissions().mode() & 0o777;
    assert_eq!((rights("etc/shsa/token"), rights("etc/shsa/environment")), (0o600, 0o640));
    let token = fs::read_to_string(machine.path("etc/shsa/token")).unwrap();
    assert_eq!(token.trim().len(), 48);

    // As started by the unit, but on the embedded bus and another port.
    fs::write(machine.path("etc/shsa/model.yaml"), MODEL).unwrap();
    let unit = fs::read_to_string(machine.path("usr/lib/systemd/system/shsa.service")).unwrap();
    let line = unit.lines().find_map(|line| line.strip_prefix("ExecStart=")).unwrap();
    let line = line.replace("${SHSA_BUS}", "memory").replace("${CREDENTIALS_DIRECTORY}", "/etc/shsa");
    let (port, mut words) = (free_port(), line.split(' ').collect::<Vec<_>>());
    let address = format!("127.0.0.1:{port}");
    words.extend(["--http", &address]);
    let run = Started(machine.command(&words).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    let state = health(port);
    assert!(state["models"]["model"]["needs"]["v_dmin"].is_object(), "{state}");
    drop(run);
    assert!(machine.path("var/lib/shsa/state/model.json").exists());

    // A second installation keeps the operator's files, and so does a removal; only purging removes them.
    fs::write(machine.path("etc/shsa/environment"), "SHSA_BUS=memory\n").unwrap();
    machine.done(&["dpkg", "--no-triggers", "--install", "/shsa.deb"]);
    assert_eq!(fs::read_to_string(machine.path("etc/shsa/token")).unwrap(), token);
    assert_eq!(fs::read_to_string(machine.path("etc/shsa/environment")).unwrap(), "SHSA_BUS=memory\n");
    machine.done(&["dpkg", "--no-triggers", "--remove", "shsa"]);
    assert!(!machine.path("usr/bin/shsa").exists() && machine.path("var/lib/shsa/state/model.json").exists());
    machine.done(&["dpkg", "--no-triggers", "--purge", "shsa"]);
    assert!(!machine.path("etc/shsa").exists() && !machine.path("var/lib/shsa").exists());
}

/// The commands of the section about packages in `docs/deployment.md`, except those that build.
fn commands() -> Vec<String> {
    let page = fs::read_to_string(format!("{ROOT}/docs/deployment.md")).unwrap();
    let section = page.split("\n## ").find(|section| section.starts_with("From a package\n")).unwrap();
    let blocks = section.split("```console\n").skip(1).filter_map(|rest| rest.split("```").next());
    let lines = blocks.flat_map(str::lines).filter_map(|line| line.strip_prefix("$ "));
    let builds = |line: &&str| ["docker ", "cargo ", "cmp "].iter().any(|begin| line.starts_with(begin));
    lines.filter(|line| !builds(line)).map(str::to_owned).collect()
}

#[test]
fn the_page_about_the_package_is_right() {
    let folder = Folder::new();
    let (package, again) = (package(), package_in(folder.path("package")));
    assert!(
        fs::read(package).unwrap() == fs::read(again).unwrap(),
        "the package differs when it is built again"
    );
    let machine = match Machine::begin(&folder.path("machine")) {
        Ok(machine) => machine,
        Err(why) => return eprintln!("SKIPPED: the commands of the page are not run: {why}"),
    };
    fs::create_dir_all(machine.path("target/package")).unwrap();
    fs::copy(package, machine.path("target/package/shsa.deb")).unwrap();
    fs::write(machine.path("car.yaml"), MODEL).unwrap();
    fs::create_dir_all(machine.path("var/backups")).unwrap();
    let commands = commands();
    assert!(commands.len() > 10, "{commands:?}");
    for command in commands {
        // No service manager runs in the copy, so the test starts and ends the program as the unit would.
        match &*command {
            "systemctl start shsa" => run_for_a_while(&machine),
            "systemctl stop shsa" => {}
            command => {
                let line = format!("cd / && {command}");
                if command.starts_with("shsa replay") {
                    machine.run(&["sh", "-c", &line]);
                } else {
                    machine.done(&["sh", "-c", &line]);
                }
            }
        }
    }
    assert!(!machine.path("var/lib/shsa").exists());
}

/// Runs the program as in the unit for two seconds, on the embedded bus.
fn run_for_a_while(machine: &Machine) {
    let unit = fs::read_to_string(machine.path("usr/lib/systemd/system/shsa.service")).unwrap();
    let line = unit.lines().find_map(|line| line.strip_prefix("ExecStart=")).unwrap();
    let line = line.replace("${SHSA_BUS}", "memory").replace("${CREDENTIALS_DIRECTORY}", "/etc/shsa");
    let words: Vec<&str> = line.split(' ').chain(["--http", "off", "--for", "2s"]).collect();
    machine.run(&words);
}

/// What builds containers here.
enum Builder {
    Docker,
    /// Buildah keeps its images in a folder of the test, and needs no service and no control groups.
    Buildah(PathBuf),
}

impl Builder {
    /// One that works; `Err` says why there is none.
    fn find(folder: &Folder) -> Result<Builder, &'static str> {
        if Builder::Docker.tried(&["info"]).is_ok_and(|output| output.status.success()) {
            return Ok(Builder::Docker);
        }
        let buildah = Builder::Buildah(folder.path("images"));
        match buildah.tried(&["from", "--name", "probe", "scratch"]) {
            Ok(output) if output.status.success() => Ok(buildah),
            Ok(_) => Err("docker is not running, and buildah may not make containers here"),
            Err(_) => Err("docker is not running, and buildah is not here"),
        }
    }

    fn tried(&self, line: &[&str]) -> std::io::Result<Output> {
        let mut command = match self {
            Builder::Docker => Command::new("docker"),
            Builder::Buildah(place) => {
                let mut command = Command::new("buildah");
                command.args(["--storage-driver", "vfs", "--root"]).arg(place.join("kept"));
                command.arg("--runroot").arg(place.join("running")).env("BUILDAH_ISOLATION", "chroot");
                command
            }
        };
        command.args(line).output()
    }

    #[track_caller]
    fn done(&self, line: &[&str]) -> Output {
        let output = self.tried(line).unwrap();
        assert!(output.status.success(), "{line:?}: {}", String::from_utf8_lossy(&output.stderr));
        output
    }

    /// Builds an image, runs it with a model and arguments, and removes it; returns what it has said.
    #[track_caller]
    fn ran(&self, context: &str, model: &str, arguments: &[&str]) -> String {
        let (file, name) =
            (format!("{ROOT}/deploy/Containerfile"), format!("shsa-test-{}", std::process::id()));
        let (mount, token) = (format!("{model}:/etc/shsa/model.yaml:ro"), format!("SHSA_TOKEN={TOKEN}"));
        self.done(&["build", "-q", "-f", &file, "-t", &name, context]);
        let given = ["-v", &mount, "-e", &token];
        let ran = match self {
            Builder::Docker => self.done(&[&["run", "--rm"][..], &given, &[&name], arguments].concat()),
            Builder::Buildah(_) => {
                self.done(&["from", "--name", "test", &name]);
                let form = "{{range .OCIv1.Config.Entrypoint}}{{println .}}{{end}}";
                let entry = self.done(&["inspect", "--format", form, "test"]).stdout;
                let entry = String::from_utf8(entry).unwrap();
                let words: Vec<&str> = entry.lines().filter(|word| !word.is_empty()).collect();
                self.done(&[&["run"][..], &given, &["test", "--"], &words, arguments].concat())
            }
        };
        if matches!(self, Builder::Docker) {
            self.done(&["rmi", &name]);
        }
        String::from_utf8(ran.stderr).unwrap()
    }
}

#[test]
fn the_container_is_built_and_runs() {
    let folder = Folder::new();
    let builder = match Builder::find(&folder) {
        Ok(builder) => builder,
        Err(why) => return eprintln!("SKIPPED: no container is built: {why}"),
    };
    let package = package();
    let model = folder.path("model.yaml");
    fs::write(&model, MODEL).unwrap();
    // Buildah's containers have the network of this machine, where the port may be taken.
    let arguments = ["--http", "off", "--for", "1 s"];
    let context = package.parent().unwrap();
    let said = builder.ran(context.to_str().unwrap(), model.to_str().unwrap(), &arguments);
    assert!(said.contains("\"level\":\"info\""), "{said}");
}
