# Scheduling of jobs.


onstart:
    # Disable the limit on job starts per second for local jobs. With the limit (the default), Snakemake 9 starts a timer at every
    # scheduler pass, and each timer triggers a further pass after one second. The number of timers grows with every finished job;
    # after 100 jobs the scheduler uses a tenth of a core. Local jobs are limited by the number of cores; cluster jobs keep the limit.
    if workflow.local_exec:
        workflow.scheduler.job_rate_limiter = None
