"""A batch on a real Slurm: a controller and two nodes on this machine, nodes that are drained, tasks
that are killed, a controller that is restarted. Nothing is lost, nothing done twice.

Skipped where Slurm is not installed (apt install slurm-wlm)."""

import json
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

PILESIM = os.environ["PILESIM"]
CONFIGURATION = """ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
AuthType=auth/none
CredType=cred/none
SlurmUser={user}
SlurmdUser={user}
StateSaveLocation={root}/state
SlurmdSpoolDir={root}/spool-%n
SlurmctldPidFile={root}/controller.pid
SlurmdPidFile={root}/node-%n.pid
SlurmctldLogFile={root}/controller.log
SlurmdLogFile={root}/node-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,batch_sched_delay=0,bf_interval=1
MpiDefault=none
ReturnToService=2
JobRequeue=1
KillWait=2
NodeName=n[1-2] NodeHostname={host} NodeAddr=127.0.0.1 Port={node_port}-{last_port} CPUs=1 RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes=n[1-2] Default=YES MaxTime=60 State=UP
"""
SCENE = {
    "version": 1, "duration_s": 1.5, "frame_rate": 30,
    "materials": {"wood": {}},
    "shapes": {"ground": {"type": "plane"}, "box": {"type": "box", "size": [0.1, 0.06, 0.04]}},
    "bodies": [{"name": "ground", "shape": "ground", "material": "wood", "role": "static"}],
    "emitters": [{"name": "boxes", "type": "disk", "shape": "box", "material": "wood", "centre": [0, 0.8, 0],
                  "radius": 0.15, "height": 0.8, "count": 40}]}
PLAN = {"version": 1, "scene": "scene.json", "count": 40,
        "vary": [{"set": "/emitters/0/count", "integers": [20, 60]}], "steps": [["simulate"]]}
HANGING_S = 240  # nothing is judged by it


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports


@unittest.skipUnless(all(shutil.which(name) for name in ("slurmctld", "slurmd", "sbatch")),
                     "Slurm is not installed: apt install slurm-wlm")
class Slurm(unittest.TestCase):
    def setUp(self):
        self.root = Path(tempfile.mkdtemp(prefix="pilesim_slurm."))
        self.addCleanup(shutil.rmtree, self.root, ignore_errors=True)
        (self.root / "state").mkdir()
        # Ports of nodes follow each other.
        port = node_port = 0
        while not port or port in (node_port, node_port + 1):
            port, node_port = free_ports(2)
        configuration = self.root / "slurm.conf"
        configuration.write_text(CONFIGURATION.format(
            host=socket.gethostname().split(".")[0], root=self.root, port=port, node_port=node_port,
            last_port=node_port + 1, user=subprocess.check_output(["id", "-un"], text=True).strip()))
        self.environment = os.environ | {"SLURM_CONF": str(configuration)}
        self.daemons = []
        self.addCleanup(self.end_daemons)
        self.controller = self.start(["slurmctld", "-D", "-c"])
        for name in ("n1", "n2"):
            self.start(["slurmd", "-D", "-N", name])
        if not self.comes_true(lambda: self.say("sinfo", "-h", "-o", "%T", "-N").split() == ["idle"] * 2):
            log = self.root / "controller.log"
            self.skipTest("Slurm does not start here: " + (log.read_text()[-500:] if log.exists() else ""))
        (self.root / "scene.json").write_text(json.dumps(SCENE))
        (self.root / "plan.json").write_text(json.dumps(PLAN))

    def start(self, words):
        self.daemons.append(subprocess.Popen(words, env=self.environment, cwd=self.root,
                                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        return self.daemons[-1]

    def end_daemons(self):
        self.say("scancel", "--user", str(os.getuid()), check=False)
        self.comes_true(lambda: not self.say("squeue", "-h").strip())
        for daemon in reversed(self.daemons):
            if daemon.poll() is None:
                daemon.terminate()
            try:
                daemon.wait(20)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()

    def say(self, *words, check=True):
        done = subprocess.run(words, env=self.environment, cwd=self.root, text=True, capture_output=True)
        if check:
            self.assertEqual(done.returncode, 0, f"{words}: {done.stderr}")
        return done.stdout

    def comes_true(self, what):
        """Until a daemon has ended, or all hangs."""
        for _ in range(4 * HANGING_S):
            try:
                if what():
                    return True
            except AssertionError:
                pass  # a controller that is away
            if any(daemon.poll() is not None for daemon in self.daemons):
                return False
            time.sleep(0.25)
        return False

    def jobs_done(self):
        return len(list((self.root / "out" / "jobs").glob("*/[0-9]*")))

    def test_a_batch_survives_what_happens_to_clusters(self):
        self.say(PILESIM, "batch", "plan.json", "-o", "here", "-q")
        printed = self.say(PILESIM, "batch", "plan.json", "-o", "out", "--slurm", "--task-minutes", "0.02")
        self.assertIn("submitted: job", printed)
        array = printed.split("submitted: job ")[1].split(",")[0]

        # A task is killed, with all that it started, and queued again; so is one by hand.
        self.assertTrue(self.comes_true(lambda: self.jobs_done() >= 2), printed)
        self.say("scontrol", "update", "NodeName=n1", "State=DRAIN", "Reason=test")
        running = self.say("squeue", "-h", "-r", "-t", "R", "-j", array, "-o", "%i").split()
        for task in running:
            self.say("scontrol", "requeue", task, check=False)
        self.assertTrue(self.comes_true(lambda: self.jobs_done() >= 8))
        # The controller is away for a while. (Killed outright it forgets what was submitted in the
        # seconds before.)
        self.controller.send_signal(signal.SIGTERM)
        self.controller.wait()
        self.daemons.remove(self.controller)
        self.controller = self.start(["slurmctld", "-D"])
        def node_is_back():
            self.say("scontrol", "update", "NodeName=n1", "State=RESUME", check=False)
            return "drain" not in self.say("sinfo", "-h", "-n", "n1", "-o", "%T")
        self.assertTrue(self.comes_true(node_is_back), self.say("sinfo", "-N", "-l", check=False))
        # A task dies in the middle, and is submitted once more by the same command.
        self.assertTrue(self.comes_true(lambda: self.jobs_done() >= 12))
        running = self.say("squeue", "-h", "-r", "-t", "R", "-j", array, "-o", "%i").split()
        for task in running:
            self.say("scancel", "--full", "--signal=KILL", task, check=False)

        self.assertTrue(self.comes_true(lambda: self.say("squeue", "-h").strip() == ""),
                        self.say("squeue", check=False))
        table = (self.root / "out" / "table.csv").read_text()
        self.assertGreater(table.count("\n"), 12)
        printed = self.say(PILESIM, "batch", "plan.json", "-o", "out", "--slurm")
        self.assertTrue(self.comes_true(lambda: self.say("squeue", "-h").strip() == ""))

        index = (self.root / "out" / "index.jsonl").read_text()
        for record in map(json.loads, index.splitlines()):
            self.assertEqual(record["end"], "done", f"{record}, {printed}")
        self.assertEqual(index, (self.root / "here" / "index.jsonl").read_text())
        left = list((self.root / "out" / "jobs").glob("*/.*"))
        self.assertEqual(left, [])


if __name__ == "__main__":
    unittest.main()
