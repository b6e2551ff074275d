# SPDX-License-Identifier: Apache-2.0
"""A Slurm cluster of two nodes on this machine: real munged, slurmctld and slurmd, in namespaces of their own.

enter_namespaces() starts the running script anew as the first process of its own process, network, mount and host name
namespaces. When it ends, however it ends, the kernel ends every process in them, so no daemon and no job outlives it;
the ports, the loopback device and what is mounted are nobody else's.
"""
import fcntl
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

INSIDE = "SQMAP_INSIDE_NAMESPACES"
HOST, ADDRESS = "sqmap", "10.0.0.1"
NODES = ("node1", "node2")
CPUS, MEMORY_MB = 4, 16000  # what each node claims to have: one task of bake_array.sbatch
START_TIMEOUT_S = 60
JOB_TIMEOUT_S = 900
POLL_S = 0.05
SIOCSIFFLAGS, SIOCSIFADDR = 0x8914, 0x8916  # linux/sockios.h
IFF_UP, IFF_LOOPBACK, IFF_RUNNING = 0x1, 0x8, 0x40  # linux/if.h

# Tasks share no processor; nothing of systemd or control groups is needed. ReturnToService: a node that was started
# anew is used again. MinJobAge: how long the controller can still tell how a job ended.
CONFIG = """ClusterName=sqmap
SlurmctldHost={host}({address})
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmdSpoolDir={folder}/spool/%n
StateSaveLocation={folder}/state
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/builtin
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=5
MinJobAge=3600
MpiDefault=none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MailProg=/bin/true
{nodes}
PartitionName=all Nodes={names} Default=YES State=UP MaxTime=INFINITE
"""


def start_loopback():
    """Slurm's look-up of addresses (AI_ADDRCONFIG) finds none on a machine that has only 127.0.0.1: hence ADDRESS."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sH14x", b"lo", IFF_UP | IFF_LOOPBACK | IFF_RUNNING))
        fcntl.ioctl(any_socket, SIOCSIFADDR,
                    struct.pack("16sH2x4s8x", b"lo:1", socket.AF_INET, socket.inet_aton(ADDRESS)))


def enter_namespaces():
    """Returns in the new namespaces; ends the process where there can be none."""
    if os.environ.get(INSIDE):
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))  # the first process has no default
        socket.sethostname(HOST)
        start_loopback()
        return
    if os.geteuid() != 0:
        sys.exit("slurm: error: the daemons and namespaces need root; run as root")
    os.environ[INSIDE] = "1"
    os.execvp("unshare", ["unshare", "--fork", "--pid", "--kill-child", "--mount-proc", "--net", "--uts",
                          sys.executable, "-B", *sys.argv])


def wait_until(claim, what, timeout_s):
    """The first true value of claim()."""
    end = time.monotonic() + timeout_s
    while not (value := claim()):
        if time.monotonic() > end:
            raise TimeoutError(f"{what}: not after {timeout_s} s")
        time.sleep(POLL_S)
    return value


def processes(*words, environment=""):
    """Numbers of the living processes whose first arguments end in these words and whose environment has this line."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            arguments = (folder / "cmdline").read_text(encoding="utf-8", errors="replace").split("\0")
            variables = (folder / "environ").read_text(encoding="utf-8", errors="replace").split("\0")
        except OSError:  # it has ended
            continue
        if len(arguments) > len(words) and all(a.endswith(w) for a, w in zip(arguments, words)):
            if not environment or environment in variables:
                found.append(int(folder.name))
    return found


class Cluster:
    """The daemons, started by `with`. All they write lies in `folder`, which goes with them."""

    def __init__(self):
        self.holder = tempfile.TemporaryDirectory(prefix="sqmap-cluster-")
        self.folder = Path(self.holder.name)
        self.folder.chmod(0o755)  # munged wants clients to reach its socket, and nobody else to write there
        self.daemons = []
        self.nodes = {}
        self.environment = {**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf")}

    def __enter__(self):
        try:
            self.start()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_):
        self.stop()

    def start(self):
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o600)
        nodes = "\n".join(f"NodeName={name} NodeHostname={HOST} NodeAddr={ADDRESS} Port={6820 + k} CPUs={CPUS} "
                          f"RealMemory={MEMORY_MB}" for k, name in enumerate(NODES))
        config = CONFIG.format(folder=self.folder, host=HOST, address=ADDRESS, nodes=nodes, names=",".join(NODES))
        (self.folder / "slurm.conf").write_text(config, encoding="ascii")
        self.daemon("munged", "--foreground", f"--socket={self.folder}/munge.socket", f"--key-file={key}",
                    f"--pid-file={self.folder}/munged.pid", f"--log-file={self.folder}/munged.log",
                    f"--seed-file={self.folder}/munged.seed", f"--origin={ADDRESS}")
        self.daemon("slurmctld", "-D")
        for name in NODES:
            self.start_node(name)
        try:
            wait_until(self.is_idle, "both nodes idle", START_TIMEOUT_S)
        except TimeoutError as problem:
            raise RuntimeError(f"{problem}\n{self.logs()}") from problem

    def daemon(self, program, *arguments):
        with open(self.folder / f"{program}-{len(self.daemons)}.log", "wb") as log:
            self.daemons.append(subprocess.Popen([program, *arguments], env=self.environment, stdin=subprocess.DEVNULL,
                                                 stdout=log, stderr=log))
        return self.daemons[-1]

    def start_node(self, name):
        (self.folder / "spool" / name).mkdir(parents=True, exist_ok=True)
        self.nodes[name] = self.daemon("slurmd", "-D", "-N", name)

    def crash_node(self, name):
        """As a power failure would: its daemon and all it runs are gone at once. Tells the controller."""
        self.nodes[name].kill()
        for job in self.jobs("sqbake"):
            if job["JobState"] == "RUNNING" and job["NodeList"] == name:
                for pid in processes(f"slurmstepd: [{job['JobId']}.batch]") + \
                        processes("", environment=f"SLURM_JOB_ID={job['JobId']}"):
                    os.kill(pid, signal.SIGKILL)
        self.set_node(name, "DOWN")

    def stop(self):
        for daemon in reversed(self.daemons):
            daemon.terminate()
        for daemon in reversed(self.daemons):
            try:
                daemon.wait(timeout=20)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        self.holder.cleanup()

    def logs(self):
        """The last words of the daemons, for whoever finds out why the cluster does not work."""
        return "\n".join(f"{path.name}:\n{path.read_text(encoding='utf-8', errors='replace')[-2000:]}"
                         for path in sorted(self.folder.glob("*.log")))

    def call(self, program, *arguments, check=True):
        """What a client of the cluster prints."""
        result = subprocess.run([program, *map(str, arguments)], env=self.environment, stdin=subprocess.DEVNULL,
                                capture_output=True, text=True, timeout=START_TIMEOUT_S, check=False)
        if check and result.returncode != 0:
            raise RuntimeError(f"{program} {arguments} ended with {result.returncode}: {result.stderr}\n{self.logs()}")
        return result.stdout

    def is_idle(self):
        return self.call("sinfo", "--noheader", "--Node", "--format=%T", check=False).split() == ["idle"] * len(NODES)

    def set_node(self, name, state):
        self.call("scontrol", "update", f"NodeName={name}", f"State={state}", "Reason=test")

    def jobs(self, name):
        """What the controller knows of each job or array task of that name: field to text."""
        lines = self.call("scontrol", "--oneliner", "show", "job").splitlines()
        jobs = [dict(field.split("=", 1) for field in line.split() if "=" in field) for line in lines]
        return [job for job in jobs if job.get("JobName") == name]

    def tasks(self):
        """The tasks of the array that was submitted last, by number."""
        jobs = self.jobs("sqbake")
        newest = max(int(job["ArrayJobId"]) for job in jobs)
        return {job["ArrayTaskId"]: job for job in jobs if int(job["ArrayJobId"]) == newest}

    def cancel_all(self):
        self.call("scancel", "--user=root")
        wait_until(lambda: not self.call("squeue", "--noheader"), "all jobs gone", START_TIMEOUT_S)

    def heal(self, name):
        """Brings a node back that was drained or has crashed."""
        if self.nodes[name].poll() is not None:
            self.start_node(name)
        else:
            # Refused where nothing is the matter with it, as after a test that failed early.
            self.call("scontrol", "update", f"NodeName={name}", "State=RESUME", check=False)
        wait_until(self.is_idle, "both nodes idle", START_TIMEOUT_S)

    def start_now(self, number):
        """A requeued task would wait for minutes."""
        task = wait_until(lambda: self.tasks()[number] if self.tasks()[number]["JobState"] == "PENDING" else None,
                          f"task {number} requeued", JOB_TIMEOUT_S)
        self.call("scontrol", "update", f"JobId={task['JobId']}", "StartTime=now")

    def wait_for(self, job_id):
        """How a job ended: its fields."""
        def ended():
            jobs = [job for job in self.jobs("sqbake-merge") if job["JobId"] == job_id]
            return jobs[0] if jobs and jobs[0]["JobState"] not in ("PENDING", "RUNNING", "COMPLETING") else None
        return wait_until(ended, f"job {job_id} ended", JOB_TIMEOUT_S)
