//! Confines a process before it reads its first input: it can compute, read standard input and write standard output, and nothing
//! else.

use crate::error::{Context, RuntimeError, unfit};
use std::io;

/// Confines the process for good. It may allocate `memory` bytes beyond its present memory.
///
/// From then on the kernel refuses to open files or sockets, to start processes or threads, to send signals to other processes,
/// to read inherited files other than standard input, and to dump memory.
///
/// # Errors
/// When the operating system lacks one of these limits; the process must not go on then.
#[cfg(target_os = "linux")]
pub(super) fn enter(memory: u64) -> Result<(), RuntimeError> {
    close_inherited()?;
    limit(memory)?;
    seccompiler::apply_filter(&filter()?).map_err(unfit).context("the filter of system calls")?;
    Ok(())
}

/// Always, on other systems than Linux.
#[cfg(not(target_os = "linux"))]
pub(super) fn enter(_: u64) -> Result<(), RuntimeError> {
    Err(unfit("processes are shut in on Linux only"))
}

/// Closes the files that the process has inherited.
#[cfg(target_os = "linux")]
fn close_inherited() -> Result<(), RuntimeError> {
    let open = std::fs::read_dir("/proc/self/fd").context("the open files")?;
    let numbers = open.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    let numbers: Vec<i32> = numbers.filter(|number| *number > 2).collect();
    for number in numbers {
        // One of the numbers was the directory itself, which is closed by now.
        let _ = nix::unistd::close(number);
    }
    Ok(())
}

#[cfg(target_os = "linux")]
fn limit(memory: u64) -> Result<(), RuntimeError> {
    use rustix::process::{Resource, Rlimit, setrlimit};
    let statm = std::fs::read_to_string("/proc/self/statm").context("the memory in use")?;
    let pages: u64 = statm.split(' ').next().and_then(|pages| pages.parse().ok()).unwrap_or(0);
    let own = pages.saturating_mul(rustix::param::page_size() as u64);
    let limits = [
        (Resource::As, own.saturating_add(memory), "memory"),
        (Resource::Core, 0, "dumps"),
        (Resource::Fsize, 0, "files"),
        (Resource::Memlock, 0, "locked memory"),
        (Resource::Nproc, 0, "processes"),
        (Resource::Nofile, 3, "open files"),
    ];
    for (resource, most, what) in limits {
        let limit = Rlimit { current: Some(most), maximum: Some(most) };
        setrlimit(resource, limit).map_err(io::Error::from).with_context(|| format!("limiting {what}"))?;
    }
    Ok(())
}

/// The permitted system calls; every other one fails with "operation not permitted".
#[cfg(target_os = "linux")]
fn filter() -> Result<seccompiler::BpfProgram, RuntimeError> {
    use seccompiler::SeccompCmpArgLen::Dword;
    use seccompiler::SeccompCmpOp::{Eq, MaskedEq};
    use seccompiler::{SeccompAction, SeccompCondition, SeccompFilter, SeccompRule, TargetArch};
    use std::collections::BTreeMap;
    /// The flag of executable memory.
    const EXECUTABLE: u64 = libc::PROT_EXEC as u64;
    let only = |conditions: Vec<(u8, seccompiler::SeccompCmpOp, u64)>| -> Result<SeccompRule, RuntimeError> {
        let conditions = conditions.into_iter();
        let conditions =
            conditions.map(|(argument, is, value)| SeccompCondition::new(argument, Dword, is, value));
        let conditions = conditions.collect::<Result<_, _>>().map_err(unfit)?;
        SeccompRule::new(conditions).map_err(unfit)
    };
    let process = u64::from(std::process::id());
    // Memory without a file behind it, and without executable pages.
    let memory = || only(vec![(2, MaskedEq(EXECUTABLE), 0), (4, Eq, u64::from(u32::MAX))]);
    let mut rules: BTreeMap<i64, Vec<SeccompRule>> = BTreeMap::from([
        (libc::SYS_read, vec![only(vec![(0, Eq, 0)])?]),
        (libc::SYS_write, vec![only(vec![(0, Eq, 1)])?, only(vec![(0, Eq, 2)])?]),
        (libc::SYS_writev, vec![only(vec![(0, Eq, 1)])?, only(vec![(0, Eq, 2)])?]),
        (libc::SYS_mmap, vec![memory()?]),
        (libc::SYS_mprotect, vec![only(vec![(2, MaskedEq(EXECUTABLE), 0)])?]),
        // `abort` needs it.
        (libc::SYS_tgkill, vec![only(vec![(0, Eq, process)])?]),
    ]);
    let harmless = [
        libc::SYS_brk,
        libc::SYS_munmap,
        libc::SYS_mremap,
        libc::SYS_madvise,
        libc::SYS_futex,
        libc::SYS_getrandom,
        libc::SYS_clock_gettime,
        libc::SYS_gettid,
        libc::SYS_getpid,
        libc::SYS_rt_sigreturn,
        libc::SYS_rt_sigprocmask,
        libc::SYS_rt_sigaction,
        libc::SYS_sigaltstack,
        libc::SYS_restart_syscall,
        libc::SYS_exit,
        libc::SYS_exit_group,
    ];
    rules.extend(harmless.map(|call| (call, Vec::new())));
    let machine: TargetArch = std::env::consts::ARCH
        .try_into()
        .map_err(|_| unfit(format!("system calls cannot be filtered on {}", std::env::consts::ARCH)))?;
    let refused = SeccompAction::Errno(libc::EPERM as u32);
    let filter = SeccompFilter::new(rules, refused, SeccompAction::Allow, machine).map_err(unfit)?;
    filter.try_into().map_err(unfit)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use std::io::Write;
    use std::process::{Command, Stdio};

    /// Tells the test that it runs in the sandbox.
    const INSIDE: &str = "SHSA_TEST_INSIDE";
    /// The allocator has reserved some memory for the test's thread; four times this amount exceeds both.
    const GRANT: usize = 32 << 20;

    /// Runs one test of this file again in a process that enters the sandbox; returns its output and its exit status.
    fn inside(test: &str) -> (String, std::process::ExitStatus) {
        let output = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "--nocapture", "--test-threads=1", &format!("sandbox::confine::tests::{test}")])
            .env(INSIDE, "1")
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let text = [output.stdout, output.stderr].concat();
        (String::from_utf8_lossy(&text).into_owned(), output.status)
    }

    fn is_inside() -> bool {
        std::env::var_os(INSIDE).is_some()
    }

    /// Tries each action in the sandbox and prints a line for each: its name and its result. Exits without running the test's
    /// other threads.
    fn report(tries: &[(&str, &dyn Fn() -> std::io::Result<()>)]) -> ! {
        enter(GRANT as u64).unwrap();
        for (what, act) in tries {
            let came = act().map_or_else(|error| format!("{:?}", error.kind()), |()| "done".to_owned());
            println!("tried {what}: {came}");
        }
        std::io::stdout().flush().unwrap();
        std::process::exit(0)
    }

    #[test]
    fn nothing_but_its_pipes_is_within_reach() {
        use std::fs;
        use std::net::{TcpListener, TcpStream, UdpSocket};
        if is_inside() {
            report(&[
                ("a file", &|| fs::read("/etc/hostname").map(drop)),
                ("its own memory map", &|| fs::read("/proc/self/maps").map(drop)),
                ("writing a file", &|| fs::write(std::env::temp_dir().join("shsa-sandbox"), "x")),
                ("a folder", &|| fs::read_dir("/").map(drop)),
                ("a connection", &|| TcpStream::connect("127.0.0.1:9").map(drop)),
                ("listening", &|| TcpListener::bind("127.0.0.1:0").map(drop)),
                ("a datagram", &|| UdpSocket::bind("127.0.0.1:0").map(drop)),
                ("a program", &|| Command::new("/bin/true").status().map(drop)),
                ("a thread", &|| std::thread::Builder::new().spawn(|| ()).map(drop)),
                ("more memory than a little", &|| {
                    Vec::<u8>::new()
                        .try_reserve_exact(4 * GRANT)
                        .map_err(|_| std::io::ErrorKind::OutOfMemory.into())
                }),
                ("a little memory", &|| {
                    Vec::<u8>::new()
                        .try_reserve_exact(GRANT / 4)
                        .map_err(|_| std::io::ErrorKind::OutOfMemory.into())
                }),
                ("writing what it says", &|| std::io::stdout().write_all(b"")),
            ]);
        }
        let (printed, status) = inside("nothing_but_its_pipes_is_within_reach");
        let denied =
            ["a file", "its own memory map", "writing a file", "a folder", "a connection", "listening"];
        for what in denied.into_iter().chain(["a datagram", "a program", "a thread"]) {
            assert!(printed.contains(&format!("tried {what}: PermissionDenied\n")), "{what}: {printed}");
        }
        assert!(printed.contains("tried more memory than a little: OutOfMemory\n"), "{printed}");
        assert!(printed.contains("tried a little memory: done\n"), "{printed}");
        assert!(printed.contains("tried writing what it says: done\n"), "{printed}");
        assert_eq!(status.code(), Some(0), "{printed}");
    }

    #[test]
    fn who_takes_more_memory_than_granted_is_ended() {
        if is_inside() {
            enter(GRANT as u64).unwrap();
            let mut hoard = Vec::new();
            for _ in 0..1_000 {
                hoard.push(vec![1_u8; 1 << 20]);
            }
            println!("took {} MiB", hoard.len());
            std::process::exit(0);
        }
        let (printed, status) = inside("who_takes_more_memory_than_granted_is_ended");
        assert!(!status.success() && !printed.contains("took"), "{printed}");
        assert!(printed.contains("memory allocation of"), "{printed}");
    }
}
