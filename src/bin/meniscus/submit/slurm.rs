//! Slurm: a job array, each of whose tasks makes a part, and a job after it. A task that a node loses is queued again and goes on
//! where it was: finished pictures are not made again.

use super::{Engined, Job, line, quoted};

pub fn files(job: &Job) -> Engined {
    let script = |name: &str, log: &str, command: &str| {
        // Slurm's own directives know no quoting: the log lies beside the script, from where it is handed over.
        format!(
            "#!/bin/sh\n#SBATCH --job-name={name}\n#SBATCH --output={log}\n#SBATCH --open-mode=append\n#SBATCH --requeue\n\
             cd -- {} || exit\nexec {command}\n",
            quoted(&job.folder)
        )
    };
    let part = job.part("");
    // The part's number is the shell's to fill in.
    let (of, words) = part.split_last().expect("a part's command ends with its number");
    let part = format!("{} \"$SLURM_ARRAY_TASK_ID\"{}", line(words), quoted(of));
    Engined {
        files: vec![
            ("parts.sh", script("meniscus-parts", "part-%a.log", &part)),
            ("join.sh", script("meniscus-join", "join.log", &line(&job.join()))),
        ],
        submit: format!(
            "parts=$(sbatch --parsable --array=0-{} \"$@\" parts.sh)\n\
             join=$(sbatch --parsable --dependency=afterok:\"${{parts%%;*}}\" --kill-on-invalid-dep=yes \"$@\" join.sh)\n\
             echo \"parts: job ${{parts%%;*}}, joined by job ${{join%%;*}}\"",
            job.tasks - 1
        ),
        by: "sbatch",
        package: "slurm-client (Debian, Ubuntu)",
    }
}
