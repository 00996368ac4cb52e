# Targets of the project; `make help` lists them. Plain `make` sets up the environment and runs the campaign.
PYTHON ?= python3
CORES ?= 2
BIN := .venv/bin
READY := .venv/ready
# tables of the reference campaign that are kept in docs/reference
REFERENCE := soil repose plane_shear steady_strength peak_strength screening reachability calibration iterations minima \
	posterior equivalents equivalents_simulated identifiability verification sensitivity coverage

# packages that `make docs` documents
API := dem dem.solids dem.experiments dem.measure dem.contact dem.ledger virtual_soil.calibration virtual_soil.exports

.DEFAULT_GOAL := campaign

campaign: setup  ## the complete study at default settings: results/default/report.html
	$(BIN)/snakemake -c$(CORES) all

setup: $(READY)  ## create the virtual environment with the locked versions and install the package

$(READY): requirements.lock pyproject.toml
	@PYTHONPATH=src $(PYTHON) -m virtual_soil.campaign.folders
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --requirement requirements.lock
	$(BIN)/pip install --quiet --no-deps --no-build-isolation --editable .
	touch $(READY)

test: setup lint  ## run lint, all tests (contact tests also without JIT) and the smoke campaign
	NUMBA_DISABLE_JIT=1 $(BIN)/pytest --numprocesses $(CORES) tests/dem/contact
	$(BIN)/pytest --numprocesses $(CORES) --durations=25 --durations-min=20

test-slurm: setup  ## run the smoke campaign on a local SLURM with two virtual nodes; needs Debian and root
	tests/slurm/run.sh

lint: setup  ## check style, types, workflow and spelling
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/python .ci/lint_workflow.py
	$(BIN)/codespell

format: setup  ## rewrite Python and Snakemake files in the project's style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

status:  ## show the progress of a study, during or after its run: STUDY=<name> (default: default)
	@$(BIN)/python -m virtual_soil.campaign.status $(if $(STUDY),--study $(STUDY))

new-study: setup  ## write the files of a new study: STUDY=<name>; optionally SOIL=<name>, WHEEL, PLATE, CONE="key=value ..."
	@$(BIN)/python -m virtual_soil.campaign.new_study '$(STUDY)' $(SOIL) $(if $(WHEEL),--wheel '$(WHEEL)') \
		$(if $(PLATE),--plate '$(PLATE)') $(if $(CONE),--cone '$(CONE)')

smoke: setup  ## run the complete workflow with few grains, in a few minutes
	$(BIN)/snakemake -c$(CORES) all --configfile config/smoke.yaml

paper: setup  ## run the paper's own study, its shear box and its method, at its exact fidelity: half an hour to an hour
	$(BIN)/snakemake -c$(CORES) all --configfile config/paper.yaml

reference: setup  ## run the default study with heaps at the paper's fidelity; copy its tables and report to docs/reference
	$(BIN)/snakemake -c$(CORES) all --configfile config/reference.yaml
	cp $(addprefix results/reference/,$(addsuffix .parquet,$(REFERENCE)) surrogates.json report.html) docs/reference/

twin: setup  ## simulate 20 virtual soils with known grain parameters: do the stated regions hold them?
	$(BIN)/snakemake -c$(CORES) all --configfile config/twin.yaml

read-lab: setup  ## show what is understood of a laboratory file: FILE=<soil file, AGS4, or shear tests with AREA=<m2>>
	@$(BIN)/python -m virtual_soil.report.read_lab $(FILE) $(if $(AREA),--area $(AREA))

angle: setup  ## read the angle of repose from photographs of heaps: PHOTO="<files>", BOX=<l,t,r,b>, GROUND=<x0,y0,x1,y1>
	@$(BIN)/python -m virtual_soil.report.read_photo $(PHOTO) $(if $(BOX),--box=$(BOX)) $(if $(GROUND),--ground=$(GROUND))

# what `make first-answer` asks for: the soil and, in SI units, its test; GRAVITY may be earth, moon or mars
ASKED = $(strip $(if $(SOIL),soil=$(SOIL)) $(if $(RADIUS),radius_m=$(RADIUS)) $(if $(DENSITY),density_kg_m3=$(DENSITY)) \
	$(if $(GRAVITY),gravity_m_s2=$(GRAVITY)) $(if $(LIFT),lift_speed_m_s=$(LIFT)))

first-answer: setup  ## a soil on docs/reference in seconds: SOIL=<name or file>; optionally RADIUS, DENSITY, GRAVITY, LIFT
	$(BIN)/snakemake -c$(CORES) first_answer --quiet host progress reason $(if $(ASKED),--config $(ASKED))

check-results: setup  ## list the files of a finished study that differ from its manifest: STUDY=<name>
	$(BIN)/snakemake -c1 check_manifest --quiet host progress reason $(if $(STUDY),--config study=$(STUDY))

check-engine: setup  ## compare the engine with published and closed-form results: docs/verification.md
	$(BIN)/snakemake -c$(CORES) verification

paper-optima: setup  ## compare the minima of the published surrogates with the paper's optima
	$(BIN)/python -m virtual_soil.calibration.paper.optima

bench: setup  ## compare the speed of the engine with LIGGGHTS and LAMMPS, if installed
	$(BIN)/python benchmarks/engine.py

bench-quick: setup  ## measure the speed of the engine alone, in under 45 s
	$(BIN)/python benchmarks/engine.py --quick

bench-scale: setup  ## measure the cost per grain from 3000 to 300 000 grains, and the scaling with threads
	$(BIN)/python benchmarks/scale.py

bench-planning: setup  ## measure the planning time of 50 to 5000 simulations and the overhead per job
	$(BIN)/python benchmarks/planning.py --run 300

bench-bulk: setup  ## run three bulk benchmarks beside LIGGGHTS on one core: docs/bulk-benchmarks.md
	$(BIN)/snakemake -c1 --forceall bulk

check-peers: setup  ## compare heap, shear test and rolling contact with LIGGGHTS (apt-get install liggghts)
	$(BIN)/python -m virtual_soil.verification.peers --cores $(CORES)

notebook: setup  ## execute the example notebook and store its output
	$(BIN)/python docs/examples/execute.py

docs: setup  ## write the API documentation from the docstrings: build/api/index.html
	$(BIN)/python -W error -m pdoc --docformat numpy --output-directory build/api $(API)

lock: setup  ## update requirements.lock to the newest versions of all dependencies
	$(BIN)/pip install --quiet pip-tools
	$(BIN)/pip-compile --quiet --upgrade --extra dev --extra cluster --allow-unsafe --no-header --no-annotate --no-emit-index-url --no-emit-find-links \
		--no-emit-trusted-host --output-file requirements.lock pyproject.toml

# former names
verify: check-engine

verify-peers: check-peers

settings: setup  ## generate config/schema.yaml, config/config.yaml and docs/configuration.md from the settings classes
	$(BIN)/python -m virtual_soil.campaign.generate

help:  ## print this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):[^#]*## */\1\t/' | expand -t 12

.PHONY: campaign status new-study setup test test-slurm lint format smoke paper reference twin read-lab angle first-answer \
	check-results check-engine check-peers verify verify-peers settings paper-optima bench bench-quick bench-scale bench-planning bench-bulk \
	notebook docs lock help
