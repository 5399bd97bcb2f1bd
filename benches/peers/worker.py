"""A peer in a process of its own: frameworks hold one device at a time, and idle ones cost nothing."""

import contextlib
import importlib
import multiprocessing
import os
import traceback

ENGINES = {"taichi": ("mpm_taichi", "TaichiPeer"), "warp": ("mpm_warp", "WarpPeer")}


def serve(pipe, engine: str, device: str, threads: int) -> None:
    # What frameworks print is not part of the table.
    os.dup2(2, 1)
    try:
        module, name = ENGINES[engine]
        peer = getattr(importlib.import_module(module), name)(device, threads)
        pipe.send((True, None))
        while (request := pipe.recv()) is not None:
            method, arguments = request
            pipe.send((True, getattr(peer, method)(*arguments)))
    except Exception as error:
        pipe.send((False, f"{error}\n{traceback.format_exc()}"))


class PeerFailed(RuntimeError):
    """What a peer has failed with."""

    def __init__(self, worker: "Worker", words: str):
        super().__init__(words)
        self.worker = worker


class Worker:
    """Calls the methods of a `Peer` over there."""

    def __init__(self, engine: str, device: str, threads: int):
        self.engine, self.device, self.threads = engine, device, threads
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=serve, args=(theirs, engine, device, threads), daemon=True)
        self.process.start()
        theirs.close()
        self._answer()

    def __getattr__(self, method: str):
        def call(*arguments):
            # What has ended also answers nothing.
            with contextlib.suppress(OSError):
                self.pipe.send((method, arguments))
            return self._answer()

        return call

    def _answer(self):
        try:
            done, value = self.pipe.recv()
        except EOFError:
            raise PeerFailed(self, f"{self.engine} on {self.device} has ended") from None
        if not done:
            raise PeerFailed(self, value)
        return value

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self.pipe.send(None)
        self.process.join(10)
