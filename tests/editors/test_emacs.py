"""Emacs 30 with the lines of the how-to page: eglot attaches, shows diagnostics and completes; text has colours."""

import json
import os
import re
import shutil
import subprocess

import pytest

from tests.editors.page import MACHINE, TEXT, lines_for, surroundings

EMACS = shutil.which("emacs")
DRIVE = r"""
(require 'eglot)
(defun until (condition)
  (let ((end (+ (float-time) 60)))
    (while (not (funcall condition))
      (when (> (float-time) end) (error "nothing came"))
      (accept-process-output nil 0.05))))
(find-file "m.maze-machine")
(run-hooks 'post-command-hook)
(until (lambda () (eglot-current-server)))
(flymake-start)
(until (lambda () (flymake-diagnostics)))
(font-lock-ensure)
(goto-char (point-min))
(search-forward "space.l")
(let* ((table (nth 2 (eglot-completion-at-point)))
       (found (all-completions "space.l" table))
       (face (lambda (word) (goto-char (point-min)) (search-forward word)
               (symbol-name (get-text-property (match-beginning 0) 'face)))))
  (message "VERDICT %s" (json-encode (list
    :diagnostics (vconcat (mapcar #'flymake-diagnostic-text (flymake-diagnostics)))
    :completions (vconcat (mapcar #'substring-no-properties found))
    :faces (vector (funcall face "state") (funcall face "when"))))))
(ignore-errors (eglot-shutdown (eglot-current-server)))
"""


def version() -> int:
    if EMACS is None:
        return 0
    said = subprocess.run([EMACS, "--version"], capture_output=True, text=True, check=False).stdout
    found = re.search(r"Emacs (\d+)", said)
    return int(found[1]) if found else 0


@pytest.mark.skipif(version() < 30, reason="Emacs 30 is not installed")
def test_emacs_attaches_and_asks(tmp_path):
    assert EMACS is not None
    (lines,) = lines_for("Emacs", "elisp")
    (tmp_path / "init.el").write_text(lines, encoding="utf-8")
    (tmp_path / "drive.el").write_text(DRIVE, encoding="utf-8")
    (tmp_path / "m.maze-machine").write_text(TEXT, encoding="utf-8")
    command = [EMACS, "-Q", "--batch", "-l", "init.el", "-l", "drive.el"]
    done = subprocess.run(
        command, cwd=tmp_path, env=surroundings(tmp_path), capture_output=True, text=True, timeout=120, check=False
    )
    verdict = re.search(r"^VERDICT (.*)$", done.stderr, re.MULTILINE)
    assert verdict, done.stderr
    found = json.loads(verdict[1])
    assert any("rotat" in one for one in found["diagnostics"])
    assert "space.left" in found["completions"]
    assert found["faces"] == ["font-lock-keyword-face", "font-lock-keyword-face"]


PLUGIN = os.environ.get("MAZE_MACHINE_DAPE")
"""The folder of the package dape."""
DEBUG = r"""
(require 'dape)
(defun until (what condition)
  (let ((end (+ (float-time) 60)))
    (while (not (funcall condition))
      (when (> (float-time) end) (error "%s did not come" what))
      (accept-process-output nil 0.05))))
(defun frame () (let ((connection (dape--live-connection 'stopped t)))
                  (and connection (dape--current-stack-frame connection))))
(defun top () (plist-get (frame) :name))
(find-file "m.maze-machine")
(goto-char (point-min))
(forward-line 8)
(dape-breakpoint-toggle)
(dape (dape--config-eval 'maze-machine (cdr (assq 'maze-machine dape-configs))))
(until "the first stop" #'top)
(let ((first (top)))
  (call-interactively 'dape-continue)
  (until "the breakpoint" (lambda () (equal (top) "moving")))
  (until "the scopes" (lambda () (plist-get (frame) :scopes)))
  (message "VERDICT %s" (json-encode (list
    :first first
    :line (plist-get (frame) :line)
    :scopes (vconcat (mapcar (lambda (one) (plist-get one :name)) (plist-get (frame) :scopes)))))))
"""


@pytest.mark.skipif(version() < 30 or PLUGIN is None, reason="Emacs 30 or dape is not installed")
def test_dape_debugs_a_machine(tmp_path):
    assert EMACS is not None
    lines = [*lines_for("Emacs", "elisp")[:1], *lines_for("Emacs with dape", "elisp", "debugging")]
    (tmp_path / "init.el").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "drive.el").write_text(DEBUG, encoding="utf-8")
    (tmp_path / "m.maze-machine").write_text(MACHINE, encoding="utf-8")
    command = [EMACS, "-Q", "--batch", "-L", PLUGIN, "-l", "init.el", "-l", "drive.el"]
    done = subprocess.run(
        command, cwd=tmp_path, env=surroundings(tmp_path), capture_output=True, text=True, timeout=200, check=False
    )
    verdict = re.search(r"^VERDICT (.*)$", done.stderr, re.MULTILINE)
    assert verdict, done.stderr
    found = json.loads(verdict[1])
    assert (found["first"], found["line"]) == ("idle", 9)
    assert {"Variables", "Activity"} <= set(found["scopes"])
