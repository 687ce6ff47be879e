"""A YAML language server, as editors run it: what it completes, explains and marks in a file."""

from __future__ import annotations

import json
import os
import queue
import re
import shutil
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

# What the server looks for: a comment, alone on its line, with the path or the address of a schema.
MODELINE = re.compile(r"^#\s*yaml-language-server\s*:.*?\$schema=(\S+)", flags=re.MULTILINE)
NAME = "yaml-language-server"
SECONDS = 60.0


def find_server() -> str:
    """The path of the server. Skips the test by name where there is none, unless CI requires it."""
    if found := shutil.which(NAME):
        return found
    reason = f"no {NAME} (npm install -g {NAME})"
    if "editor" in os.environ.get("TRUST_ENV_REQUIRE_EXTRAS", "").split(","):
        pytest.fail(reason)
    pytest.skip(reason)


class Editor:
    """An editor with one file open, for which the server finds its schema as the file says."""

    def __init__(self, process: subprocess.Popen[bytes], file: Path):
        self.process, self.uri, self.number = process, file.as_uri(), 0
        self.replies: dict[int, queue.Queue[Any]] = {}
        self.problems: queue.Queue[list[dict[str, Any]]] = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()
        folder = file.parent.as_uri()
        self._ask("initialize", {"processId": os.getpid(), "rootUri": folder, "capabilities": {}})
        self._send({"method": "initialized", "params": {}})
        document = {"uri": self.uri, "languageId": "yaml", "version": 1, "text": file.read_text("utf-8")}
        self._send({"method": "textDocument/didOpen", "params": {"textDocument": document}})

    def completions(self, line: int, character: int) -> dict[str, str]:
        """The names that fit at a place, counted from 0, and what is said of each."""
        found = self._ask("textDocument/completion", self._at(line, character))
        items = found["items"] if isinstance(found, dict) else found
        return {item["label"]: _text(item.get("documentation") or "") for item in items}

    def hover(self, line: int, character: int) -> str:
        """What is said of what stands at a place."""
        return _text(self._ask("textDocument/hover", self._at(line, character))["contents"])

    def diagnostics(self) -> list[tuple[int, str]]:
        """What is wrong with the file: lines, counted from 0, and messages."""
        return [(one["range"]["start"]["line"], one["message"]) for one in self.problems.get(timeout=SECONDS)]

    def _at(self, line: int, character: int) -> dict[str, Any]:
        return {"textDocument": {"uri": self.uri}, "position": {"line": line, "character": character}}

    def _ask(self, method: str, params: Any) -> Any:
        self.number += 1
        reply = self.replies[self.number] = queue.Queue()
        self._send({"id": self.number, "method": method, "params": params})
        return reply.get(timeout=SECONDS)

    def _send(self, message: dict[str, Any]) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        assert self.process.stdin is not None
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.process.stdin.flush()

    def _read(self) -> None:
        for message in _messages(self.process):
            method = message.get("method")
            if method == "textDocument/publishDiagnostics":
                self.problems.put(message["params"]["diagnostics"])
            elif method == "workspace/configuration":
                self._send({"id": message["id"], "result": [None] * len(message["params"]["items"])})
            elif method is not None and "id" in message:
                self._send({"id": message["id"], "result": None})
            elif method is None:
                self.replies[message["id"]].put(message.get("result"))


def _messages(process: subprocess.Popen[bytes]) -> Iterator[dict[str, Any]]:
    assert process.stdout is not None
    while line := process.stdout.readline():
        if line.lower().startswith(b"content-length:"):
            length = int(line.split(b":")[1])
            while process.stdout.readline().strip():
                pass
            yield json.loads(process.stdout.read(length))


def _text(said: Any) -> str:
    return said["value"] if isinstance(said, dict) else str(said)


@contextmanager
def open_in_editor(file: Path) -> Iterator[Editor]:
    """A file as an editor shows it."""
    process = subprocess.Popen([find_server(), "--stdio"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        yield Editor(process, file)
    finally:
        process.kill()
        process.communicate()
