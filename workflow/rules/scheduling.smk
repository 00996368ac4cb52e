# How Snakemake is to wait for jobs.


onstart:
    # Where job starts per second are limited, as they are by default, Snakemake 9 starts a timer whenever it has looked at the
    # jobs, and each has it look again after a second: one more timer for every job that has ended, a tenth of a core after 100 jobs.
    # Jobs on this machine wait for a core anyway; on a cluster the limit stays.
    if workflow.local_exec:
        workflow.scheduler.job_rate_limiter = None
