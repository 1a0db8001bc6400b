"""Neovim with the lines of the how-to page: it attaches, shows diagnostics and completes; the grammar gives colours."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.editors.grammar import FOLDER, build
from tests.editors.page import MACHINE, TEXT, lines_for, surroundings

NVIM = shutil.which("nvim", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
DRIVE = """
local function until_true(condition) assert(vim.wait(30000, condition, 20), "nothing came") end
vim.cmd.edit("m.maze-machine")
until_true(function() return #vim.lsp.get_clients({ bufnr = 0 }) == 1 end)
until_true(function() return #vim.diagnostic.get(0) > 0 end)
local codes = vim.tbl_map(function(one) return one.code end, vim.diagnostic.get(0))
local params = { textDocument = vim.lsp.util.make_text_document_params(0), position = { line = 6, character = 16 } }
local found = vim.lsp.buf_request_sync(0, "textDocument/completion", params, 20000)
local labels = {}
for _, answer in pairs(found) do
  for _, item in ipairs(answer.result.items or answer.result) do table.insert(labels, item.label) end
end
vim.treesitter.get_parser(0):parse()
local kinds = {}
for _, one in ipairs(vim.treesitter.get_captures_at_pos(0, 4, 0)) do table.insert(kinds, one.capture) end
local client = vim.lsp.get_clients({ bufnr = 0 })[1]
local colours = client.server_capabilities.semanticTokensProvider ~= nil
local on = vim.treesitter.highlighter.active[vim.api.nvim_get_current_buf()] ~= nil
io.stdout:write(vim.json.encode({ codes = codes, labels = labels, colours = colours, kinds = kinds, on = on }))
vim.cmd("qall!")
"""


def driven(folder, configuration, limit):
    """Neovim with a configuration, driven by the script ``drive.lua`` of a folder, for at most so many seconds."""
    return subprocess.run(
        [NVIM, "--headless", "-u", configuration, "-l", "drive.lua"],
        cwd=folder,
        env=surroundings(folder),
        capture_output=True,
        text=True,
        timeout=limit,
        check=False,
    )


@pytest.mark.skipif(NVIM is None, reason="Neovim is not installed")
def test_neovim_attaches_and_asks(tmp_path):
    configuration = tmp_path / ".config" / "nvim"
    (configuration / "parser").mkdir(parents=True)
    build(tmp_path).rename(configuration / "parser" / "maze_machine.so")
    shutil.copytree(
        FOLDER / "queries", configuration / "queries" / "maze_machine", ignore=shutil.ignore_patterns("helix")
    )
    (configuration / "init.lua").write_text("\n".join(lines_for("Neovim", "lua")), encoding="utf-8")
    (tmp_path / "drive.lua").write_text(DRIVE, encoding="utf-8")
    (tmp_path / "m.maze-machine").write_text(TEXT, encoding="utf-8")
    (tmp_path / "maze-machine.toml").write_text("", encoding="utf-8")
    done = driven(tmp_path, configuration / "init.lua", limit=90)
    shown = json.loads(done.stdout or done.stderr)
    assert "E0204" in shown["codes"]
    assert shown["labels"] == ["space.left"]
    assert shown["colours"] is True
    assert shown["on"] is True
    assert "keyword.type" in shown["kinds"]


PLUGIN = os.environ.get("MAZE_MACHINE_NVIM_DAP")
"""The folder of the plugin nvim-dap."""
DEBUG = """
local function until_true(condition, what) assert(vim.wait(60000, condition, 20), what .. " did not come") end
local dap = require("dap")
local function stopped() local session = dap.session() return session and session.stopped_thread_id end
local function top() local frame = dap.session().current_frame return frame and frame.name end
vim.cmd.edit("m.maze-machine")
vim.api.nvim_win_set_cursor(0, { 9, 0 })
dap.toggle_breakpoint()
dap.run(dap.configurations["maze-machine"][1])
until_true(function() return stopped() and top() end, "the first stop")
local first = top()
dap.continue()
until_true(function() return stopped() and top() == "moving" end, "the breakpoint")
local line = dap.session().current_frame.line
until_true(function() return dap.session().current_frame.scopes end, "the scopes")
local scopes = {}
for _, one in ipairs(dap.session().current_frame.scopes) do table.insert(scopes, one.name) end
dap.step_back()
until_true(function() return stopped() and top() ~= "moving" end, "the step back")
io.stdout:write(vim.json.encode({ first = first, line = line, scopes = scopes }))
dap.terminate()
until_true(function() return dap.session() == nil end, "the end")
vim.cmd("qall!")
"""


@pytest.mark.skipif(NVIM is None or PLUGIN is None, reason="Neovim or nvim-dap is not installed")
def test_nvim_dap_debugs_a_machine(tmp_path):
    before = [f"vim.opt.runtimepath:append({json.dumps(PLUGIN)})", *lines_for("Neovim", "lua")[:1]]
    lines = [*before, *lines_for("Neovim with nvim-dap", "lua", "debugging")]
    (tmp_path / "init.lua").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "drive.lua").write_text(DEBUG, encoding="utf-8")
    (tmp_path / "m.maze-machine").write_text(MACHINE, encoding="utf-8")
    done = driven(tmp_path, tmp_path / "init.lua", limit=150)
    assert done.returncode == 0, done.stderr
    shown = json.loads(done.stdout or done.stderr)
    assert (shown["first"], shown["line"]) == ("idle", 9)
    assert {"Variables", "Activity"} <= set(shown["scopes"])
