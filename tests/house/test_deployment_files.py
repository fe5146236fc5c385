"""The examples for operators are taken by the programs that they are for, where those programs are."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from service.settings import Settings
from tests.house.repository import ROOT

FILES = ROOT / "docs" / "deployment"


def program(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed here")
    return found


def test_every_setting_in_the_examples_exists() -> None:
    for path in FILES.iterdir():
        made = {name.lower() for name in re.findall(r"SIGHTLINE_(\w+)", path.read_text(encoding="utf-8"))}
        assert made <= set(Settings.model_fields), path.name


def test_the_settings_of_the_unit_are_valid(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (FILES / "sightline.service").read_text(encoding="utf-8")
    for name, value in re.findall(r"(SIGHTLINE_\w+)=(\S+)", text):
        monkeypatch.setenv(name, value)
    assert Settings().allowed_hosts == ("sightline.example.org",)


def test_nginx_takes_its_file(tmp_path: Path) -> None:
    nginx = program("nginx")
    openssl = program("openssl")
    key, certificate = tmp_path / "key.pem", tmp_path / "cert.pem"
    made = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=sightline.example.org"]
    subprocess.run([openssl, *made, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    text = (FILES / "nginx.conf").read_text(encoding="utf-8")
    text = re.sub(r"/etc/ssl/sightline/fullchain.pem", str(certificate), text)
    text = re.sub(r"/etc/ssl/sightline/privkey.pem", str(key), text)
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    temporary = "".join(f"{kind}_temp_path {tmp_path}/{kind};\n" for kind in kinds)
    text = text.replace("http {\n", f"http {{\naccess_log off;\n{temporary}")
    (tmp_path / "nginx.conf").write_text(f"pid {tmp_path}/nginx.pid;\nerror_log stderr;\n{text}")
    checked = subprocess.run(
        [nginx, "-t", "-p", tmp_path, "-c", tmp_path / "nginx.conf"], capture_output=True, text=True
    )
    assert checked.returncode == 0, checked.stderr


def test_caddy_takes_its_file() -> None:
    command = [program("caddy"), "validate", "--adapter", "caddyfile", "--config", FILES / "Caddyfile"]
    checked = subprocess.run(command, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stderr


def test_systemd_takes_its_unit(tmp_path: Path) -> None:
    analyze = program("systemd-analyze")
    text = (FILES / "sightline.service").read_text(encoding="utf-8")
    unit = tmp_path / "sightline.service"
    # the program itself is not installed where the test runs
    unit.write_text(text.replace("/opt/sightline/bin/sightline serve", "/bin/true"))
    checked = subprocess.run([analyze, "verify", "--man=no", unit], capture_output=True, text=True)
    assert "sightline.service" not in checked.stderr, checked.stderr
    exposure = subprocess.run(
        [analyze, "security", "--offline=true", "--threshold=30", unit], capture_output=True, text=True
    )
    assert exposure.returncode == 0, exposure.stdout[-500:]


def test_docker_takes_its_file() -> None:
    docker = program("docker")
    if subprocess.run([docker, "compose", "version"], capture_output=True).returncode:
        pytest.skip("docker compose is not installed here")
    command = [docker, "compose", "-f", FILES / "compose.yaml", "config", "--quiet"]
    checked = subprocess.run(command, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stderr
